# SPDX-License-Identifier: GPL-3.0-or-later
"""One file per operator of how hair is drawn: with which engine, tables and pictures."""

from .bake_tables import VELLUS_OT_bake_tables
from .render_picture import VELLUS_OT_render_picture
from .toggle_composite import VELLUS_OT_toggle_composite
from .toggle_drawing import VELLUS_OT_toggle_drawing

CLASSES = (
    VELLUS_OT_toggle_drawing,
    VELLUS_OT_bake_tables,
    VELLUS_OT_render_picture,
    VELLUS_OT_toggle_composite,
)
