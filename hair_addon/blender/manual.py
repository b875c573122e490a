# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual for F1 and *Online Manual*: a page per panel, a heading per setting or operator.

The pages are local files: HTML in the installed extension, Markdown in docs/manual of a checkout.
"""

import re
from pathlib import Path

import bpy

from .groom.systems import hair_systems
from .settings import layer_items, map_items, preferences, properties, style_items
from .ui import operators, picture_menus

# Page → the classes whose properties it explains, unless a property has its own entry below.
_CLASSES = {
    "guides": (properties.VellusGuideSettings, *layer_items.CLASSES),
    "strands": (properties.VellusHairSettings, properties.VellusCurves),
    "dynamics": (properties.VellusDynamicsSettings, properties.VellusCollider),
    "styles": style_items.CLASSES,
    "shading": (properties.VellusAppearance, picture_menus.VellusPictures, *map_items.CLASSES),
    "lookup_tables": (properties.VellusMarschnerSettings,),
    "rendering": (properties.VellusRenderSettings, properties.VellusPassSettings),
    "index": (preferences.VellusPreferences,),
    "systems": (hair_systems.VellusSystem, hair_systems.VellusNewHair),
}

_PROPERTIES = {"model": "shading", "is_drawn": "shading", "viewport_percentage": "shading"}
_PROPERTIES |= {"table_folder": "lookup_tables", "simulates": "dynamics", "cache_folder": "dynamics"}
_PROPERTIES |= {"thickness_ramp": "shading", "is_reduced_in_viewport": "shading"}
_PROPERTIES |= {"show_guides": "systems", "guide_colors": "systems", "guide_opacity": "systems"}
_PROPERTIES |= {"shows_styles_while_combing": "surface", "keeps_outside": "surface", "style": "styles"}

# Page → the operators that it explains, a heading each.
_OPERATORS = {
    "surface": (
        *("add_hair", "comb_guides", "select_guides", "select_hair", "pick_hair", "delete_hair"),
        *("check_uvs", "use_uv_map", "make_uv_map", "attach_to_surface", "apply_scale", "restore_guides"),
        "make_own_guides",
        "flip_normals",
    ),
    "guides": (
        *("distribute_guides", "keep_guide_density", "draw_flow"),
        *("freeze_selected", "unfreeze_all", "invert_frozen"),
        *("save_selection", "select_saved", "remove_selection"),
        *("add_layer", "remove_layer", "duplicate_layer", "move_layer", "merge_layer_down", "apply_layers"),
    ),
    "guide_tools": (
        *("guide_length", "trim_guides", "change_guide_count", "mirror_guides", "copy_guide_shape"),
        *("smooth_guides", "lift_guides", "attract_guides", "drape_guides", "push_outside"),
        *("draw_tie", "gather_guides", "paint_flow", "size_flow_brush"),
    ),
    "strands": ("interpolate_hair", "keep_strand_density", "draw_parting", "paint_density", "update_hair"),
    "dynamics": (
        *("play_dynamics", "bake_dynamics", "free_dynamics", "apply_dynamics_preset", "stiffen_dynamics"),
        *("deliver_dynamics", "remove_delivery"),
    ),
    "styles": (
        *("add_style", "remove_style", "move_style", "duplicate_style", "use_points"),
        *("paint_style_mask", "mask_from_selection"),
        *("apply_style_preset", "apply_saved_style", "save_style_preset", "remove_style_preset"),
    ),
    "shading": (
        "apply_preset",
        "apply_saved_look",
        "save_look",
        "remove_look",
        "toggle_drawing",
        "edit_map",
        "paint_map",
        "add_ramp",
        "remove_ramp",
        "add_map_ramp",
        "remove_map_ramp",
        "add_course",
        "remove_course",
        "remove_map",
    ),
    "lookup_tables": ("bake_tables",),
    "systems": ("delete_system",),
    "groom_library": ("save_groom", "apply_groom", "add_grooms"),
    "use_as_guides": ("use_as_guides",),
    "use_as_hair": ("use_as_hair", "import_groom", "convert_particles"),
    "mesh_to_hair": ("mesh_to_hair",),
    "transfer_groom": ("transfer_groom",),
    "rendering": ("toggle_composite", "retry_baking"),
    "cards": ("hair_cards", "hair_tubes"),
    "output": ("render_picture", "export_groom", "save_groom_settings", "load_groom_settings"),
}


def anchor(label):
    """Return the Markdown anchor of a heading: guide-count for Guide Count."""
    return re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", label).strip().lower())


def folder():
    """Return (folder of the pages, their suffix)."""
    root = Path(__file__).resolve().parents[2]
    installed = root / "manual"
    return (installed, ".html") if installed.is_dir() else (root / "docs" / "manual", ".md")


def manual_map():
    """Return (prefix, [(pattern, page and anchor)]) for `bpy.utils.register_manual_map`."""
    pages, suffix = folder()
    targets = [
        (pattern.lower(), f"{page}{suffix}#{anchor(label)}") for pattern, page, label in (*_properties(), *_operators())
    ]
    return pages.as_uri() + "/", targets


def _properties():
    for page, classes in _CLASSES.items():
        for cls in classes:
            for entry in cls.bl_rna.properties:
                if entry.identifier in cls.__annotations__ and not entry.is_hidden and entry.name != entry.identifier:
                    pattern = f"bpy.types.{cls.__name__}.{entry.identifier}"
                    yield pattern, _PROPERTIES.get(entry.identifier, page), entry.name


def _operators():
    """Yield entries of operators, which serve their properties too."""
    labels = {cls.bl_idname.removeprefix("vellus."): cls.bl_label for cls in operators.CLASSES}
    for page, names in _OPERATORS.items():
        for name in names:
            yield f"bpy.ops.vellus.{name}", page, labels[name]


def register():
    """Register the manual's pages with Blender."""
    bpy.utils.register_manual_map(manual_map)


def unregister():
    """Unregister the manual's pages."""
    bpy.utils.unregister_manual_map(manual_map)
