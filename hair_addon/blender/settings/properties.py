# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings ↔ Blender's properties. Every default, range, unit and tooltip comes from the `Settings` classes.

A change marks its Curves as stale and tags them; the next depsgraph update notifies handlers.py. Thus a script that
sets ten properties costs one evaluation, and hair in an undo step always matches its settings.
"""

from dataclasses import replace

import bpy

from ...core.dynamics.collision.collider_settings import ColliderSettings
from ...core.dynamics.rod.settings import DynamicsSettings
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.imaging.pixel_sampling import PassSettings, RenderSettings
from ...core.shading import appearance
from ...core.shading.appearance import Appearance
from ...core.shading.tables import lookup_tables
from . import layer_items, map_items, object_names, setting_properties, shared_wetness, style_items, style_keys
from .marks import (
    mark_colliding,
    mark_dynamics,
    mark_geometry,
    mark_shading,
    mark_shown,
    mark_water_of_guides,
    mark_wetness,
)
from .translations import CONTEXT

_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"}  # paths may begin with //
_NOT_KEYED = set()  # options of properties that cannot be keyed
OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}  # properties that a shot may override on a linked character

MODELS = (
    ("KAJIYA_KAY", "Kajiya-Kay", "Opaque cylinder with a diffuse part and one highlight"),
    (
        "MARSCHNER",
        "Marschner",
        "Translucent fiber with reflection, transmission, and internal reflection from lookup tables",
    ),
)

# A change of these restarts the simulation.
_UNKEYED = ("vertex_count", "start_frame", "preroll", "size")


def own_look_of(state):
    """Return the `Appearance` set for a hair; state: its `VellusCurves`. Raises `HairError`."""
    return setting_properties.to_settings(state.appearance, Appearance)


def look_of(state):
    """Return the `Appearance` that a hair is shaded with: its own, with the largest shared wetness applied."""
    return appearance.wetted(own_look_of(state), shared_wetness.of_hair(state)[1])


def dry_look_of(state):
    """Return the `Appearance` of strands that no masked Wet style reaches: with the least shared wetness applied."""
    return appearance.wetted(own_look_of(state), shared_wetness.of_hair(state)[0])


def own_table_settings_of(state):
    """Return the `lookup_tables.Settings` of a hair, with defaults for those of its look. Raises `HairError`."""
    return setting_properties.to_settings(state.marschner, lookup_tables.Settings, skip=appearance.TABLE_FIELDS)


def own_dynamics_of(state):
    """Return the `DynamicsSettings` set for guides; state: their `VellusCurves`. Raises `HairError`."""
    return setting_properties.to_settings(state.dynamics, DynamicsSettings)


def dynamics_of(state):
    """Return the `DynamicsSettings` that guides are simulated with: as wet as their hair. Raises `HairError`."""
    return replace(own_dynamics_of(state), wetness=shared_wetness.of_guides(state))


def keyed_dynamics_of(state):
    """Return the names of the animated or driven settings of `dynamics_of`."""
    paths = style_keys.keyed_paths(state.id_data)
    names = {name for name in setting_properties.names_of(DynamicsSettings) if f"vellus.dynamics.{name}" in paths}
    return names | ({"wetness"} if shared_wetness.is_keyed(state) else set())


def table_settings_of(state, look=None):
    """Return the `lookup_tables.Settings` that the Marschner model shades a hair with. Raises `HairError`.

    look: a dry `Appearance`; None for `look_of` the hair.
    """
    settings = appearance.table_settings(look_of(state) if look is None else look, own_table_settings_of(state))
    # Rounded as in an operator's properties, so that tables baked with these settings match.
    return setting_properties.as_stored(settings)


def _renew_passes(_group, context):
    context.view_layer.update_render_passes()


def _tag_scene(group, _context):
    group.id_data.update_tag()


def _all_but_wetness(settings_class):
    return set(setting_properties.names_of(settings_class)) - {"wetness"}


class VellusGuideSettings(bpy.types.PropertyGroup):
    """Distribution and growth of guides"""

    __annotations__ = setting_properties.annotations(GuideSettings, mark_geometry)


class VellusHairSettings(bpy.types.PropertyGroup):
    """Interpolation of hair between guides"""

    __annotations__ = setting_properties.annotations(HairSettings, mark_geometry)


class VellusAppearance(bpy.types.PropertyGroup):
    """Appearance of hair, in the viewport and in Cycles"""

    __annotations__ = {
        **setting_properties.annotations(Appearance, mark_shading),
        **setting_properties.annotations(Appearance, mark_wetness, skip=_all_but_wetness(Appearance)),
    }


class VellusMarschnerSettings(bpy.types.PropertyGroup):
    """Settings of the Marschner model's tables that are not in the appearance"""

    __annotations__ = setting_properties.annotations(lookup_tables.Settings, mark_shading, skip=appearance.TABLE_FIELDS)


class VellusDynamicsSettings(bpy.types.PropertyGroup):
    """Simulation of guides"""

    __annotations__ = {
        **setting_properties.annotations(DynamicsSettings, mark_dynamics, unkeyed=_UNKEYED, override=OVERRIDABLE),
        **setting_properties.annotations(
            DynamicsSettings, mark_water_of_guides, skip=_all_but_wetness(DynamicsSettings), override=OVERRIDABLE
        ),
    }


class VellusCollider(bpy.types.PropertyGroup):
    """Hair and a mesh object: how hair collides with it, and where new hair grows"""

    __annotations__ = {
        **setting_properties.annotations(ColliderSettings, mark_colliding),
        "new_hair_mask": bpy.props.StringProperty(options={"HIDDEN"}),
        "has_new_hair_mask": bpy.props.BoolProperty(options={"HIDDEN"}),
    }


class VellusCurves(bpy.types.PropertyGroup):
    """Vellus data of a Curves datablock"""

    kind: bpy.props.EnumProperty(
        items=[
            ("NONE", "None", "Not created by Vellus"),
            ("GUIDES", "Guides", "Guides that hair follows"),
            ("HAIR", "Hair", "Strands between guides"),
        ],
        default="NONE",
    )
    guide_curves: bpy.props.PointerProperty(
        name="Guides",
        description="Guides that this hair follows",
        translation_context=CONTEXT,
        type=bpy.types.Curves,
        poll=lambda _group, curves: curves.vellus.kind == "GUIDES",
        override=OVERRIDABLE,
        update=mark_geometry,
    )
    guides: bpy.props.PointerProperty(type=VellusGuideSettings)
    hair: bpy.props.PointerProperty(type=VellusHairSettings)
    styles: bpy.props.CollectionProperty(type=style_items.VellusStyle)
    active_style: bpy.props.IntProperty(min=0, options=set())
    maps: bpy.props.CollectionProperty(type=map_items.VellusMap)
    thickness_ramp: bpy.props.PointerProperty(
        name="Thickness Curve",
        description="Node group with the thickness curve from root to tip",
        translation_context=CONTEXT,
        type=bpy.types.NodeTree,
        options={"HIDDEN"},
        update=mark_geometry,
    )
    thickness_key: bpy.props.StringProperty(
        description="Digest of the thickness curve of the stored radii", options={"HIDDEN"}
    )
    layers: bpy.props.CollectionProperty(type=layer_items.VellusLayer)
    active_layer: bpy.props.IntProperty(min=0, options=set())
    layered: bpy.props.StringProperty(description="Fingerprint of the points that layers give", options={"HIDDEN"})
    is_base_grown: bpy.props.BoolProperty(description="Whether settings grow the base of layers", options={"HIDDEN"})
    model: bpy.props.EnumProperty(
        name="Shading Model",
        description="Scattering model that shades the hair in the viewport",
        translation_context=CONTEXT,
        items=MODELS,
        default="MARSCHNER",
        update=mark_shading,
    )
    appearance: bpy.props.PointerProperty(type=VellusAppearance)
    marschner: bpy.props.PointerProperty(type=VellusMarschnerSettings)
    table_folder: bpy.props.StringProperty(
        name="Table Folder",
        description="Folder with baked lookup tables; they are used while their settings match this hair",
        translation_context=CONTEXT,
        subtype="DIR_PATH",
        options=_RELATIVE,
        update=mark_shading,
    )
    is_drawn: bpy.props.BoolProperty(
        name="Shaded in Viewport",
        description="Draw this hair with its shading model; when off, Blender draws it as curves",
        translation_context=CONTEXT,
        default=True,
        update=mark_shading,
    )
    viewport_percentage: bpy.props.IntProperty(
        name="Strands in Viewport",
        description="Percentage of strands that viewports show, thickened to compensate; renders show all strands",
        translation_context=CONTEXT,
        subtype="PERCENTAGE",
        min=1,
        max=100,
        default=100,
    )
    is_reduced_in_viewport: bpy.props.BoolProperty(
        name="Reduce Distant Hair",
        description="Show distant hair in viewports with fewer, thicker strands; renders are unchanged",
        translation_context=CONTEXT,
        default=True,
    )
    show_guides: bpy.props.BoolProperty(
        name="Show Guides",
        description="Show the guides in viewports while they are not selected; without hair they always are",
        translation_context=CONTEXT,
        default=False,
        update=mark_shading,
    )
    guide_colors: bpy.props.EnumProperty(
        name="Guide Colors",
        description="Colors of guides in viewports",
        translation_context=CONTEXT,
        items=[
            ("PLAIN", "Plain", "One muted color for all guides"),
            ("SYSTEM", "Hair System", "One color for the guides of each hair system"),
            ("GUIDE", "Guide", "A different color for each guide"),
            ("LENGTH", "Length", "From blue for the shortest guide to red for the longest one"),
            ("CLUMP", "Clump", "One color for each clump of guides, by the first style that gathers strands"),
            ("TIE", "Tie", "One color for the gathered guides of each tie or row; others are plain"),
        ],
        default="PLAIN",
        update=mark_shown,
    )
    guide_opacity: bpy.props.FloatProperty(
        name="Guide Opacity",
        description="Opacity of guides in viewports: decrease it to see the hair behind them",
        translation_context=CONTEXT,
        subtype="FACTOR",
        min=0.0,
        max=1.0,
        default=0.8,
        update=mark_shown,
    )
    shows_styles_while_combing: bpy.props.BoolProperty(
        name="Comb Styled",
        description="Show hair with its styles while its guides are combed. When off, viewports show it straight and "
        "strokes take less time; files and renders have styled hair",
        translation_context=CONTEXT,
        default=True,
        update=mark_shown,
    )
    keeps_outside: bpy.props.BoolProperty(
        name="Keep Outside",
        description="Keep combed guides outside of the posed surface: each stroke or edit pushes their points out",
        translation_context=CONTEXT,
        default=True,
        options=_NOT_KEYED,
    )
    is_live: bpy.props.BoolProperty(
        name="Auto Update",
        description="Update automatically when settings or inputs change",
        translation_context=CONTEXT,
        default=True,
        update=mark_shown,
    )
    simulates: bpy.props.BoolProperty(
        name="Simulate",
        description="Simulate the guides while the animation plays: they move with the surface, fall and collide",
        translation_context=CONTEXT,
        default=False,
        options=_NOT_KEYED,
        override=OVERRIDABLE,
        update=mark_dynamics,
    )
    dynamics: bpy.props.PointerProperty(type=VellusDynamicsSettings, override=OVERRIDABLE)
    cache_folder: bpy.props.StringProperty(
        name="Cache Folder",
        description="Folder that baked frames are written to, each hair system in a folder of its own",
        translation_context=CONTEXT,
        subtype="DIR_PATH",
        options=_RELATIVE,
        override=OVERRIDABLE,
        default="//haircache",
    )
    cache_identity: bpy.props.StringProperty(description="Folder of the baked frames", options={"HIDDEN"})
    delivered_key: bpy.props.StringProperty(description="Baked frames that were delivered", options={"HIDDEN"})
    tie_lines: bpy.props.StringProperty(description="Object of the curves that gather these guides", options={"HIDDEN"})
    was_combed: bpy.props.BoolProperty(description="Sculpt Mode was fitted to these guides", options={"HIDDEN"})
    is_stale: bpy.props.BoolProperty(default=False, options={"HIDDEN"})
    is_shading_stale: bpy.props.BoolProperty(default=False, options={"HIDDEN"})
    is_dynamics_stale: bpy.props.BoolProperty(default=False, options={"HIDDEN"})
    topology: bpy.props.StringProperty(description="Triangulation that the stored roots refer to", options={"HIDDEN"})
    is_on_open: bpy.props.BoolProperty(description="Whether the surface has holes", options={"HIDDEN"})
    cage_topology: bpy.props.StringProperty(
        description="Faces before subdivision that the stored roots refer to", options={"HIDDEN"}
    )
    root_key: bpy.props.StringProperty(description="Settings and inputs that placed the roots", options={"HIDDEN"})
    style_images_key: bpy.props.StringProperty(
        description="Fingerprint of the images that mask styles", options={"HIDDEN"}
    )
    fit_key: bpy.props.StringProperty(description="Inputs that sizes were fitted to", options={"HIDDEN"})
    parting_key: bpy.props.StringProperty(description="Settings and inputs that parted the hair", options={"HIDDEN"})
    flow_key: bpy.props.StringProperty(description="Flow lines that the guides were grown along", options={"HIDDEN"})
    written: bpy.props.StringProperty(description="Fingerprint of the generated points", options={"HIDDEN"})
    kept_written: bpy.props.StringProperty(description="Fingerprint of moved strands", options={"HIDDEN"})
    followed: bpy.props.StringProperty(description="Fingerprint of the followed guides", options={"HIDDEN"})
    shading_status: bpy.props.StringProperty(description="Shading error", options={"HIDDEN"})
    uv_status: bpy.props.StringProperty(description="Problem with the surface's UV map", options={"HIDDEN"})
    dynamics_status: bpy.props.StringProperty(description="Simulation error", options={"HIDDEN"})
    status: bpy.props.StringProperty(description="Update error", options={"HIDDEN"})


class VellusRenderSettings(bpy.types.PropertyGroup):
    """Render settings of Vellus"""

    __annotations__ = {
        **setting_properties.annotations(RenderSettings, _tag_scene),
        "hair_scene": bpy.props.PointerProperty(
            description="Scene that renders the hair", type=bpy.types.Scene, options={"HIDDEN"}
        ),
        "baked_in": bpy.props.StringProperty(
            description="File that the frames of linked guides were baked in", options={"HIDDEN"}
        ),
    }


class VellusPassSettings(bpy.types.PropertyGroup):
    """Render passes of Vellus in a view layer"""

    __annotations__ = setting_properties.annotations(PassSettings, _renew_passes)


CLASSES = (
    *style_items.CLASSES,
    *map_items.CLASSES,
    *layer_items.CLASSES,
    VellusGuideSettings,
    VellusHairSettings,
    VellusAppearance,
    VellusMarschnerSettings,
    VellusDynamicsSettings,
    VellusCollider,
    VellusCurves,
    VellusRenderSettings,
    VellusPassSettings,
)


def register():
    """Attach the settings to every Curves datablock, object, scene and view layer."""
    bpy.types.Curves.vellus = bpy.props.PointerProperty(type=VellusCurves, override=OVERRIDABLE)
    bpy.types.Object.vellus = bpy.props.PointerProperty(type=VellusCollider)
    bpy.types.Scene.vellus = bpy.props.PointerProperty(type=VellusRenderSettings)
    bpy.types.ViewLayer.vellus = bpy.props.PointerProperty(type=VellusPassSettings)


def unregister():
    """Unregister the settings; values in files remain."""
    del bpy.types.ViewLayer.vellus
    del bpy.types.Scene.vellus
    del bpy.types.Object.vellus
    del bpy.types.Curves.vellus


def folder(description):
    """Return the `directory` property, which a file browser sets."""
    return bpy.props.StringProperty(
        name="Folder", description=description, subtype="DIR_PATH", options=_RELATIVE, translation_context=CONTEXT
    )


def file(description):
    """Return the `filepath` property, which a file browser sets."""
    return bpy.props.StringProperty(
        name="File", description=description, subtype="FILE_PATH", options=_RELATIVE, translation_context=CONTEXT
    )


def group_of(group_class):
    """Return a pointer property to a property group."""
    return bpy.props.PointerProperty(type=group_class)


def only_files(pattern):
    """Return the `filter_glob` property of a file browser."""
    return bpy.props.StringProperty(default=pattern, options={"HIDDEN"})


def text(name, description, is_remembered=False):
    """Return a string property that is not a setting; is_remembered: whether the operator keeps its last value."""
    options = set() if is_remembered else {"SKIP_SAVE"}
    return bpy.props.StringProperty(name=name, description=description, options=options, translation_context=CONTEXT)


def hidden_text():
    """Return a text property of an operator that only its button sets."""
    return bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})


def choice(name, description, labels, tooltips=None):
    """Return an enumeration that is not a setting; labels: {identifier: label}; tooltips: {identifier: tooltip}, or
    None.
    """
    items = [(identifier, label, (tooltips or {}).get(identifier, "")) for identifier, label in labels.items()]
    return bpy.props.EnumProperty(name=name, description=description, items=items, translation_context=CONTEXT)


def mesh_name(name, description):
    """Return a property for the name of a mesh object, with search; operators do not keep its value."""
    return bpy.props.StringProperty(
        name=name,
        description=description,
        options={"SKIP_SAVE"},
        translation_context=CONTEXT,
        search=object_names.meshes,
        search_options=set(),
    )


def switch(name, description, default):
    """Return a boolean that is not a setting."""
    return bpy.props.BoolProperty(name=name, description=description, default=default, translation_context=CONTEXT)


def count(name, description, default):
    """Return a positive integer that is not a setting."""
    return bpy.props.IntProperty(
        name=name, description=description, default=default, min=1, soft_max=100, translation_context=CONTEXT
    )
