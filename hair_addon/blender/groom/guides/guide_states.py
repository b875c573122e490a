# SPDX-License-Identifier: GPL-3.0-or-later
"""State of guides for panels: whether they are combed, and their length.

Read once after each change of the guides.
"""

from dataclasses import dataclass

from bpy.types import Curves

from ...data.strands import curves
from ...host.caches import Cache
from . import guide_tools


@dataclass(frozen=True)
class GuideState:
    """Whether settings do not apply to guides, and the guides' median length [m] at the surface's scale."""

    is_combed: bool
    length: float
    scale: tuple[float, ...]


state_cache = Cache()  # session_uid of Curves → GuideState


def of(guides: Curves) -> GuideState:
    """Return the `GuideState` of guide Curves."""
    surface = guides.surface
    scale = () if surface is None else tuple(surface.matrix_world.to_scale())
    known = state_cache.get(guides.session_uid)
    if known is None or known.scale != scale:
        found = GuideState(curves.is_combed(guides), guide_tools.median_length(guides), scale)
        known = state_cache.keep(guides.session_uid, found)
    return known
