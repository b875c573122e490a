# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per tool that changes combed guides in place."""

from .attract_guides import VELLUS_OT_attract_guides
from .guide_length import VELLUS_OT_guide_length
from .lift_guides import VELLUS_OT_lift_guides
from .smooth_guides import VELLUS_OT_smooth_guides
from .trim_guides import VELLUS_OT_trim_guides

CLASSES = (
    VELLUS_OT_guide_length,
    VELLUS_OT_trim_guides,
    VELLUS_OT_smooth_guides,
    VELLUS_OT_lift_guides,
    VELLUS_OT_attract_guides,
)
