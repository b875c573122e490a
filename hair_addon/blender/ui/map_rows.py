# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of a map: its kind, the picker of this kind, and how it changes its setting; the curve of the thickness."""

import textwrap

from ...core.errors import HairError
from ...core.maps import varied_settings
from ..data.strands import curves
from ..groom.styles import painted_maps
from ..settings import map_items, ramp_nodes
from ..settings.translations import error_text

_CHARACTERS = 44  # of a line of the popover


def button(layout, state, setting):
    """Draw the button of a setting that a map may vary; its icon is colored where there is a map."""
    item = map_items.item_of(state, setting)
    has_map = item is not None and map_items.is_set(item)
    icon = "NODE_TEXTURE" if has_map else "DOT"
    side = layout.row()
    side.emboss = "NONE"
    side.operator("vellus.edit_map", text="", icon=icon).setting = setting


def draw(layout, item, hair):
    """Draw the rows of a map of hair Curves; if these cannot be edited, the rows are gray below the reason."""
    try:
        curves.require_editable(hair)
    except HairError as error:
        for line in textwrap.wrap(error_text(error), _CHARACTERS):
            layout.label(text=line, translate=False)
        layout = layout.column()
        layout.enabled = False
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(item, "kind")
    surface = curves.grown_on(hair)
    if item.kind == "IMAGE":
        layout.template_ID(item, "image", new="image.new", open="image.open")
        if surface is not None:
            layout.prop_search(item, "uv", surface.data, "uv_layers")
    elif item.kind == "GROUP" and surface is not None:
        layout.prop_search(item, "source", surface, "vertex_groups")
    elif item.kind == "ATTRIBUTE" and surface is not None:
        layout.prop_search(item, "source", surface.data, "attributes")
    elif item.kind == "CURVES":
        layout.prop_search(item, "source", hair, "attributes")
    elif item.kind in {"STRAND", "CLUMP"}:
        layout.prop(item, "seed")
    if item.kind in painted_maps.MODES and surface is not None:
        layout.operator("vellus.paint_map", text="Paint", icon="BRUSH_DATA").setting = item.setting
    if varied_settings.is_color(item.setting):
        layout.prop(item, "amount")
    else:
        layout.prop(item, "low")
        layout.prop(item, "high")
    layout.prop(item, "is_inverted")
    _map_ramp_rows(layout, item)
    layout.operator("vellus.remove_map", icon="X").setting = item.setting


def _map_ramp_rows(layout, item):
    """Draw the ramp of a map, or the button that adds it."""
    node = ramp_nodes.node_of(item.ramp_tree)
    if node is None:
        layout.operator("vellus.add_map_ramp", icon="NORMALIZE_FCURVES").setting = item.setting
        return
    if ramp_nodes.is_color(node):
        layout.template_color_ramp(node, "color_ramp")
    else:
        layout.template_curve_mapping(node, "mapping")
    layout.operator("vellus.remove_map_ramp", icon="X").setting = item.setting


def ramp_rows(layout, hair):
    """Draw the curve of the thickness of hair Curves, or the button that adds it."""
    node = ramp_nodes.node_of(hair.vellus.thickness_ramp)
    if node is None:
        layout.operator("vellus.add_ramp", icon="NORMALIZE_FCURVES")
        return
    layout.template_curve_mapping(node, "mapping")
    layout.operator("vellus.remove_ramp", icon="X")
