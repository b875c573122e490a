# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of a map: its kind, the picker of this kind, and how it changes its setting; curves from root to tip."""

import textwrap

from ...core.errors import HairError
from ...core.maps import varied_settings
from ...core.styling import kinds
from ..data.strands import curves
from ..groom.styles import painted_maps
from ..settings import map_items, ramp_nodes, style_items
from ..settings.translations import error_text

_CHARACTERS = 44  # of a line of the popover


def button(layout, state, setting):
    """Draw the button of a setting that a map may vary; its icon is colored where there is a map."""
    item = map_items.item_of(state, setting)
    has_map = item is not None and (map_items.is_set(item) or item.course_tree is not None)
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
        if hair.library is not None:
            layout.label(text="Strands keep the map's values of that file")
        layout = layout.column()
        layout.enabled = False
    layout.use_property_split = True
    layout.use_property_decorate = False
    details = _details(item, hair)
    if details is None or details.may_vary:
        _source_rows(layout, item, hair)
    if details is not None and details.has_course:
        _course_rows(layout, item)
    elif details is not None:
        layout.label(text="The setting has one value per strand, so it has no curve from root to tip", icon="INFO")
    if item.course_tree is None or map_items.is_set(item):
        layout.operator("vellus.remove_map", icon="X").setting = item.setting


def _details(item, hair):
    """Return the `Param` of a setting of a style; None for other settings."""
    name, setting = varied_settings.style_of(item.setting)
    styles = (style for style in hair.vellus.styles if style.name == name)
    kind = next((kinds.KINDS[style.kind] for style in styles), None)
    return None if kind is None else varied_settings.details_of_style(kind(), setting)


def _source_rows(layout, item, hair):
    """Draw the source of a map, and how the map changes its setting."""
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
    if _value(hair.vellus, item.setting) == 0.0:
        layout.label(text="The setting is 0: its map has no effect", icon="INFO")
    _map_ramp_rows(layout, item)


def _value(state, setting):
    """Return the value of a setting of hair or guides; None if they do not have it."""
    section, _, name = setting.partition(".")
    style, of_style = varied_settings.style_of(setting)
    if style:
        groups = [style_items.group_of(item) for item in state.styles if item.name == style]
        return getattr(groups[0], of_style, None) if groups else None
    return getattr(getattr(state, {"look": "appearance", "strands": "hair"}.get(section, section)), name, None)


def _course_rows(layout, item):
    """Draw the curve of a setting from root to tip, or the button that adds it."""
    layout.separator()
    node = ramp_nodes.node_of(item.course_tree)
    if node is None:
        layout.operator("vellus.add_course", icon="NORMALIZE_FCURVES").setting = item.setting
        return
    layout.label(text="From root to tip")
    layout.template_curve_mapping(node, "mapping")
    layout.operator("vellus.remove_course", icon="X").setting = item.setting


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
