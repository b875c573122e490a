# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of files and meshes made of a groom: exports, settings, cards, tubes."""

from .export_groom import VELLUS_OT_export_groom
from .hair_cards import VELLUS_OT_hair_cards
from .hair_tubes import VELLUS_OT_hair_tubes
from .load_groom_settings import VELLUS_OT_load_groom_settings
from .save_groom_settings import VELLUS_OT_save_groom_settings

CLASSES = (
    VELLUS_OT_save_groom_settings,
    VELLUS_OT_load_groom_settings,
    VELLUS_OT_export_groom,
    VELLUS_OT_hair_cards,
    VELLUS_OT_hair_tubes,
)
