# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per tool that changes combed guides in place."""

from .attract_guides import VELLUS_OT_attract_guides
from .change_guide_count import VELLUS_OT_change_guide_count
from .copy_guide_shape import VELLUS_OT_copy_guide_shape
from .drape_guides import VELLUS_OT_drape_guides
from .guide_length import VELLUS_OT_guide_length
from .lift_guides import VELLUS_OT_lift_guides
from .mirror_guides import VELLUS_OT_mirror_guides
from .smooth_guides import VELLUS_OT_smooth_guides
from .trim_guides import VELLUS_OT_trim_guides

CLASSES = (
    VELLUS_OT_guide_length,
    VELLUS_OT_trim_guides,
    VELLUS_OT_change_guide_count,
    VELLUS_OT_mirror_guides,
    VELLUS_OT_copy_guide_shape,
    VELLUS_OT_smooth_guides,
    VELLUS_OT_lift_guides,
    VELLUS_OT_attract_guides,
    VELLUS_OT_drape_guides,
)
