# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of looks: presets and saved ones."""

from .apply_preset import VELLUS_OT_apply_preset
from .apply_saved_look import VELLUS_OT_apply_saved_look
from .remove_look import VELLUS_OT_remove_look
from .save_look import VELLUS_OT_save_look

CLASSES = (
    VELLUS_OT_apply_preset,
    VELLUS_OT_apply_saved_look,
    VELLUS_OT_save_look,
    VELLUS_OT_remove_look,
)
