# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of styles."""

from .add_style import VELLUS_OT_add_style
from .apply_saved_style import VELLUS_OT_apply_saved_style
from .apply_style_preset import VELLUS_OT_apply_style_preset
from .duplicate_style import VELLUS_OT_duplicate_style
from .mask_from_selection import VELLUS_OT_mask_from_selection
from .move_style import VELLUS_OT_move_style
from .paint_style_mask import VELLUS_OT_paint_style_mask
from .remove_style import VELLUS_OT_remove_style
from .remove_style_preset import VELLUS_OT_remove_style_preset
from .save_style_preset import VELLUS_OT_save_style_preset
from .use_points import VELLUS_OT_use_points

CLASSES = (
    VELLUS_OT_add_style,
    VELLUS_OT_move_style,
    VELLUS_OT_remove_style,
    VELLUS_OT_duplicate_style,
    VELLUS_OT_use_points,
    VELLUS_OT_paint_style_mask,
    VELLUS_OT_mask_from_selection,
    VELLUS_OT_apply_style_preset,
    VELLUS_OT_apply_saved_style,
    VELLUS_OT_save_style_preset,
    VELLUS_OT_remove_style_preset,
)
