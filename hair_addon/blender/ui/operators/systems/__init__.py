# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of hair systems: grown, combed, selected, deleted."""

from .add_hair import VELLUS_OT_add_hair
from .comb_guides import VELLUS_OT_comb_guides
from .delete_hair import VELLUS_OT_delete_hair
from .delete_system import VELLUS_OT_delete_system
from .distribute_guides import VELLUS_OT_distribute_guides
from .draw_lines import VELLUS_OT_draw_flow, VELLUS_OT_draw_parting
from .interpolate_hair import VELLUS_OT_interpolate_hair
from .make_own_guides import VELLUS_OT_make_own_guides
from .pick_hair import VELLUS_OT_pick_hair
from .restore_guides import VELLUS_OT_restore_guides
from .select_guides import VELLUS_OT_select_guides
from .select_hair import VELLUS_OT_select_hair
from .update_hair import VELLUS_OT_update_hair

CLASSES = (
    VELLUS_OT_add_hair,
    VELLUS_OT_distribute_guides,
    VELLUS_OT_interpolate_hair,
    VELLUS_OT_comb_guides,
    VELLUS_OT_draw_parting,
    VELLUS_OT_draw_flow,
    VELLUS_OT_select_guides,
    VELLUS_OT_select_hair,
    VELLUS_OT_pick_hair,
    VELLUS_OT_delete_hair,
    VELLUS_OT_delete_system,
    VELLUS_OT_restore_guides,
    VELLUS_OT_make_own_guides,
    VELLUS_OT_update_hair,
)
