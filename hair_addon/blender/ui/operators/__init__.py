# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator: read, compute, write."""

from .add_hair import VELLUS_OT_add_hair
from .bake_tables import VELLUS_OT_bake_tables
from .comb_guides import VELLUS_OT_comb_guides
from .convert_particles import VELLUS_OT_convert_particles
from .delete_hair import VELLUS_OT_delete_hair
from .delete_system import VELLUS_OT_delete_system
from .distribute_guides import VELLUS_OT_distribute_guides
from .export_groom import VELLUS_OT_export_groom
from .hair_cards import VELLUS_OT_hair_cards
from .hair_tubes import VELLUS_OT_hair_tubes
from .interpolate_hair import VELLUS_OT_interpolate_hair
from .load_groom_settings import VELLUS_OT_load_groom_settings
from .pick_hair import VELLUS_OT_pick_hair
from .render_picture import VELLUS_OT_render_picture
from .restore_guides import VELLUS_OT_restore_guides
from .save_groom_settings import VELLUS_OT_save_groom_settings
from .select_guides import VELLUS_OT_select_guides
from .select_hair import VELLUS_OT_select_hair
from .toggle_composite import VELLUS_OT_toggle_composite
from .toggle_drawing import VELLUS_OT_toggle_drawing
from .transfer_groom import VELLUS_OT_transfer_groom
from .use_as_guides import VELLUS_OT_use_as_guides
from .use_as_hair import VELLUS_OT_use_as_hair

CLASSES = (
    VELLUS_OT_add_hair,
    VELLUS_OT_distribute_guides,
    VELLUS_OT_interpolate_hair,
    VELLUS_OT_use_as_guides,
    VELLUS_OT_use_as_hair,
    VELLUS_OT_convert_particles,
    VELLUS_OT_transfer_groom,
    VELLUS_OT_comb_guides,
    VELLUS_OT_select_guides,
    VELLUS_OT_select_hair,
    VELLUS_OT_pick_hair,
    VELLUS_OT_delete_hair,
    VELLUS_OT_delete_system,
    VELLUS_OT_toggle_drawing,
    VELLUS_OT_restore_guides,
    VELLUS_OT_bake_tables,
    VELLUS_OT_render_picture,
    VELLUS_OT_toggle_composite,
    VELLUS_OT_save_groom_settings,
    VELLUS_OT_load_groom_settings,
    VELLUS_OT_export_groom,
    VELLUS_OT_hair_cards,
    VELLUS_OT_hair_tubes,
)
