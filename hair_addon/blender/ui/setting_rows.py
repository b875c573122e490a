# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of settings: the same in the panels of the Hair tab and in the operators' redo panel."""

import bpy

from ...core.dynamics.rod.settings import DynamicsSettings
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.maps import varied_settings
from ...core.params import declared
from ...core.placement import densities
from ...core.styling.base import LockSettings, ProfiledSettings, StyleSettings
from ...core.styling.kinds import KINDS
from ..host.notices import text_of
from ..settings import fitted_sizes, length_steps, setting_properties, style_items
from ..settings.translations import interface_text
from . import map_rows

# Blender's own property split gives labels 40 % of the width, which truncates them at the default sidebar width.
NAME_SHARE = 0.54

# Names too long for one line are drawn above the value.
WIDE = ("neighbour_limit", "mode", "multiple_scattering")

_GROWTH = ("length_variation", "tilt", "gravity", "drape")
_FLOW = ("flow_lines", "lift")
_PLACEMENT = ("seed", "relax_iterations", "curvature", "symmetric")
_MASKS = ("density_group", "density_image")
_PARTING_LIMITS = ("angle_limit", "length_limit")
_PARTING_REGIONS = ("region_group", "region_attribute", "part_lines")
_INFLUENCE = ("automatic_influence", "influence_distance")
_BLENDING = ("neighbour_limit", "keep_length", "guide_map", "seed")

_MASK = ("mask", "mask_image", "invert_mask")
_STYLE_OBJECTS = ("cutter", "target")
_CENTERS = ("centers", "center_guides", "size")
_PROFILE = tuple(
    name
    for name in setting_properties.names_of(ProfiledSettings)
    if name not in setting_properties.names_of(StyleSettings)
)

_MATERIAL = ("bend_stiffness", "twist_stiffness", "stretch_stiffness", "tip_stiffness", "damping", "weight")
_FIBRE = ("youngs_modulus", "shear_modulus", "fibre_radius", "density")
_FORCES = ("gravity", "air_drag", "force_fields", "inertia")
_SHAPE = ("hold", "hold_tip", "sag_free", "pinned", "holds_ties")
_COLLIDERS = ("collides_with_surface", "colliders")
_CONTACT = ("collision_distance", "friction", "keeps_hair_outside")
_VOLUME = ("hair_friction", "hair_pressure", "cell_size")


def row(layout, owner, name, size="", map_of=""):
    """Draw a row of a property with its label in a separate column.

    size: for a property that can be fitted to the surface, the name that identifies its flag; map_of: the setting whose
    map has a button at the right, empty for none.
    """
    value_side = _below_name(layout, owner, name) if name in WIDE else _value_side(layout, owner, name)
    shown, flag = length_steps.shown_name(owner, name), fitted_sizes.flag_of(size or name)
    has_flag, is_coarse = flag in owner.bl_rna.properties, shown != name
    is_density = name in densities.COUNTS and _is_stored(owner)
    sides = value_side.row(align=True) if has_flag or is_coarse or map_of or is_density else value_side
    sides.prop(owner, shown, text="")
    if has_flag:
        sides.prop(owner, flag, text="", icon="LINKED")
    if is_density:
        is_kept = getattr(owner, name) > 0.0
        sides.operator(f"vellus.keep_{name}", text="", icon="LINKED", depress=is_kept)
    if is_coarse:
        sides.prop_decorator(owner, name)  # to key it
    if map_of:
        map_rows.button(sides, owner.id_data.vellus, map_of)


def _below_name(layout, owner, name):
    column = layout.column(align=True)
    column.use_property_split = False
    column.label(text=interface_text(owner.bl_rna.properties[name].name), translate=False)
    return column


def search_row(layout, owner, name, source, collection, **details):
    """Draw a `row` whose value is picked by name from a collection, such as the vertex groups of an object."""
    _value_side(layout, owner, name).prop_search(owner, name, source, collection, text="", **details)


def _value_side(layout, owner, name, title=""):
    sides = layout.split(factor=NAME_SHARE)
    name_side = sides.row()
    name_side.alignment = "RIGHT"
    name_side.label(text=interface_text(title or owner.bl_rna.properties[name].name), translate=False)
    value_side = sides.column()
    value_side.use_property_split = False
    return value_side


def rows(layout, owner, settings_class, names, style=""):
    """Draw a row for each of these settings of a class, in the order of declaration; style: name of theirs."""
    for name, _default, details in declared(settings_class):
        if name in names:
            known = varied_settings.setting_of_style(style, name) if style else ""
            varied = (
                (known or varied_settings.name_of(settings_class, name))
                if details.may_vary or details.has_course
                else ""
            )
            is_mapped = varied != "" and _is_stored(owner)
            shown = details.diameter[0] if details.diameter else name
            row(_of_number(layout, owner, name), owner, shown, name, varied if is_mapped else "")


def _is_stored(owner):
    """Whether these are settings of Curves, not of an operator in the redo panel."""
    return isinstance(getattr(owner, "id_data", None), bpy.types.Curves)


def _of_number(layout, owner, name):
    """Return the layout of a row: gray for a number that a density sets."""
    density = next((density for density, count in densities.COUNTS.items() if count == name), "")
    if not hasattr(owner, density):
        return layout
    column = layout.column()
    column.active = getattr(owner, density) == 0.0
    return column


def mesh_rows(layout, owner, settings_class):
    """Draw the rows of cards or tubes; the bones of chains are gray without chains."""
    rows(layout, owner, settings_class, others(settings_class, ("bone_count",)))
    column = layout.column()
    column.active = owner.chain_count > 0
    rows(column, owner, settings_class, ("bone_count",))


def others(settings_class, *shown):
    """Return the names of a class's settings that are in none of the tuples, so that every new setting has a row."""
    names = {name for names in shown for name in names}
    return tuple(name for name, _default, _details in declared(settings_class) if name not in names)


def guide_rows(layout, owner, surface, are_combed=False):
    """Number, length and masks of guides; owner: has properties of `GuideSettings`; surface: object or None.

    are_combed: gray out settings without effect on combed guides; masks still affect strands.
    """
    column = layout.column()
    column.active = not are_combed
    rows(column, owner, GuideSettings, others(GuideSettings, _GROWTH, _FLOW, _PLACEMENT, _MASKS))
    _density_rows(layout, owner, surface)


def growth_rows(layout, owner):
    """Length variation and direction of guides."""
    rows(layout, owner, GuideSettings, _GROWTH)
    row(layout, owner, "flow_lines")
    angle = layout.column()
    angle.active = owner.drape or bool(text_of(owner, "flow_lines"))
    rows(angle, owner, GuideSettings, ("lift",))


def placement_rows(layout, owner):
    """Distribution of guides on the surface."""
    rows(layout, owner, GuideSettings, _PLACEMENT)


def strand_rows(layout, owner, surface, skip=()):
    """Number, thickness and mask of strands; owner: has the properties of `HairSettings` except those in `skip`."""
    apart = (_PARTING_LIMITS, _PARTING_REGIONS, _BLENDING, _MASKS, _INFLUENCE, skip)
    rows(layout, owner, HairSettings, others(HairSettings, *apart))
    if "density_group" not in skip:
        _density_rows(layout, owner, surface)


def parting_rows(layout, owner, surface):
    """Limits, regions and lines that separate hair."""
    rows(layout, owner, HairSettings, _PARTING_LIMITS)
    _mask_row(layout, owner, "region_group", surface)
    if surface is None:
        row(layout, owner, "region_attribute")
    else:
        # Suggestions: attributes of modifiers and of guides are not listed.
        attributes = {"source": surface.data, "collection": "attributes", "results_are_suggestions": True}
        search_row(layout, owner, "region_attribute", **attributes)
    row(layout, owner, "part_lines")


def blending_rows(layout, owner, skip=()):
    """Blending of guides to strands."""
    row(layout, owner, "automatic_influence")
    distance = layout.column()
    distance.active = not owner.automatic_influence
    row(distance, owner, "influence_distance")
    rows(layout, owner, HairSettings, tuple(name for name in _BLENDING if name not in skip))


def _mask_row(layout, owner, name, surface):
    if surface is not None:
        search_row(layout, owner, name, surface, "vertex_groups")


def _density_rows(layout, owner, surface):
    if surface is not None:
        # Suggestions: attributes are not listed.
        search_row(layout, owner, "density_group", surface, "vertex_groups", results_are_suggestions=True)
    search_row(layout, owner, "density_image", bpy.data, "images")


def style_rows(layout, item):
    """Settings of a style except its mask and profile; item: its properties."""
    owner, settings_class = style_items.group_of(item), KINDS[item.kind]
    rows(layout, owner, settings_class, ("amount",), text_of(item, "name"))
    shared, name = setting_properties.names_of(StyleSettings), text_of(item, "name")
    centers = _CENTERS if issubclass(settings_class, LockSettings) else ()
    if centers:
        _center_rows(layout, item, owner, settings_class)
    rows(layout, owner, settings_class, others(settings_class, shared, _PROFILE, _STYLE_OBJECTS, centers), name)
    for name in _STYLE_OBJECTS:
        if name in owner.bl_rna.properties:
            column = layout.column()
            column.active = name != "target" or owner.direction == "OBJECT"
            search_row(column, owner, name, bpy.data, "objects")
    rows(layout, owner, settings_class, others(StyleSettings, ("is_on", "amount"), _MASK), text_of(item, "name"))


def _center_rows(layout, item, owner, settings_class):
    """Centers of locks. The selection is gray without guides, and the size if no level uses it."""
    rows(layout, owner, settings_class, ("centers",))
    is_at_guides = style_items.is_at_guides(item)
    column = layout.column()
    column.active = is_at_guides
    rows(column, owner, settings_class, ("center_guides",))
    column = layout.column()
    column.active = not is_at_guides or getattr(owner, "levels", 1) > 1
    rows(column, owner, settings_class, ("size",), text_of(item, "name"))


def profile_rows(layout, item):
    """Profile of a style's amount from root to tip."""
    rows(layout, style_items.group_of(item), KINDS[item.kind], _PROFILE, text_of(item, "name"))


def style_mask_rows(layout, item, surface):
    """Mask of a style; surface: object or None."""
    owner = style_items.group_of(item)
    if surface is None:
        row(layout, owner, "mask")
    else:
        # Suggestions: attributes are not listed.
        search_row(layout, owner, "mask", surface, "vertex_groups", results_are_suggestions=True)
    search_row(layout, owner, "mask_image", bpy.data, "images")
    row(layout, owner, "invert_mask")


def material_rows(layout, owner, wetness):
    """Stiffness, damping and weight; owner: has the properties of `DynamicsSettings`, as for the rows below.

    wetness: (owner, name) of the slider that wets the hair, possibly of its look or of a Wet style.
    """
    rows(layout, owner, DynamicsSettings, _MATERIAL)
    _value_side(layout, *wetness, title="Wetness").prop(*wetness, text="")


def fibre_rows(layout, owner):
    """Material and thickness of a single fiber."""
    rows(layout, owner, DynamicsSettings, _FIBRE)


def force_rows(layout, owner):
    """Gravity, air and the motion of the surface."""
    rows(layout, owner, DynamicsSettings, _FORCES)


def hold_rows(layout, owner):
    """The pull to the combed shape."""
    hidden = () if owner.hold > 0.0 else ("hold_tip",)
    rows(layout, owner, DynamicsSettings, [name for name in _SHAPE if name not in hidden])


def collision_rows(layout, owner):
    """Collision of guides with meshes."""
    row(layout, owner, "collides_with_surface")
    search_row(layout, owner, "colliders", bpy.data, "collections")
    if owner.collides_with_surface or owner.colliders:
        rows(layout, owner, DynamicsSettings, _CONTACT)


def volume_rows(layout, owner):
    """Friction and pressure between strands."""
    has_grid = owner.hair_friction > 0.0 or owner.hair_pressure > 0.0
    rows(layout, owner, DynamicsSettings, [name for name in _VOLUME if name != "cell_size" or has_grid])


def solver_rows(layout, owner):
    """All other settings of the simulation."""
    apart = (_MATERIAL, ("wetness",), _FIBRE, _FORCES, _SHAPE, _COLLIDERS, _CONTACT, _VOLUME)
    rows(layout, owner, DynamicsSettings, others(DynamicsSettings, *apart))


def collider_rows(layout, owner):
    """Collision of hair with an object; owner: has the properties of `ColliderSettings`."""
    for switch, name in (("overrides_friction", "friction"), ("overrides_distance", "collision_distance")):
        row(layout, owner, switch)
        if getattr(owner, switch):
            row(layout, owner, name)
    row(layout, owner, "is_double_sided")


def all_guide_rows(layout, owner, surface):
    """The rows of the Guides panel and of the panels below it, for a redo panel; only Growth is open at first."""
    guide_rows(layout, owner, surface)
    _panel(layout, "Growth", False, growth_rows, owner)
    _panel(layout, "Placement", True, placement_rows, owner)


def all_strand_rows(layout, owner, surface, skip=()):
    """The rows of the Strands panel and of the panels below it, for a redo panel; these are collapsed at first."""
    strand_rows(layout, owner, surface, skip)
    _panel(layout, "Parting", True, parting_rows, owner, surface)
    _panel(layout, "Advanced", True, blending_rows, owner, skip)


def _panel(layout, title, is_closed, draw, *parameters):
    """Draw rows in a panel; is_closed: collapsed until the user opens it. Blender remembers open panels."""
    header, body = layout.panel(f"VELLUS_PT_redo_{title.lower()}", default_closed=is_closed)
    header.label(text=interface_text(title), translate=False)
    if body is not None:
        draw(body.column(), *parameters)


def add_title(layout, title):
    """Draw a title above the next rows."""
    layout.separator()
    layout.label(text=interface_text(title), translate=False)
