# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator: read, compute, write."""

from .apply_preset import VELLUS_OT_apply_preset
from .bake_tables import VELLUS_OT_bake_tables
from .distribute_guides import VELLUS_OT_distribute_guides
from .interpolate_hair import VELLUS_OT_interpolate_hair
from .render_picture import VELLUS_OT_render_picture

CLASSES = (
    VELLUS_OT_distribute_guides,
    VELLUS_OT_interpolate_hair,
    VELLUS_OT_apply_preset,
    VELLUS_OT_bake_tables,
    VELLUS_OT_render_picture,
)
