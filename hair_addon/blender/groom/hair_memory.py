# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory checks for guides and strands before allocation."""

from bpy.types import Curves

from ...core.grooming import cost
from ...core.grooming.groom import GuideSettings, HairSettings
from ..host import memory


def strand_bytes(settings: HairSettings, target: Curves | None = None) -> int:
    """Return the additional memory of strands [bytes]; the present strands of `target` are freed.

    settings: `HairSettings`, or properties of the same names.
    """
    slot_count = settings.neighbour_limit
    needed = cost.strand_bytes(settings.strand_count, settings.point_count, slot_count)
    if target is None or not len(target.curves):
        return needed
    strands, points = len(target.curves), len(target.points)
    return needed - cost.strand_bytes(strands, -(-points // strands), slot_count)


def require_strands(settings: HairSettings, target: Curves | None = None, other_bytes: int = 0) -> None:
    """Raise `HairError` if strands need more memory than is available, as `memory.require_for_hair`.

    other_bytes: memory of other data generated with the strands.
    """
    memory.require_for_hair(strand_bytes(settings, target) + other_bytes)


def guide_bytes(settings: GuideSettings, face_count: int) -> int:
    """Return the memory of guides during and after their generation [bytes]."""
    return cost.guide_work_bytes(settings, face_count) + cost.curves_bytes(settings.guide_count)


def require_guides(settings: GuideSettings, face_count: int) -> None:
    """Raise `HairError` if guides need more memory than is available."""
    memory.require_for_hair(guide_bytes(settings, face_count))
