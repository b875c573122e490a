# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings ↔ Blender's properties. Every default, range, unit and tooltip comes from the `Settings` classes.

A change marks its Curves stale and tags them; handlers.py learns of it with the next depsgraph update. So a script
that sets ten properties pays for one evaluation, and an undo step never holds hair that its settings did not make.
"""

import math
from dataclasses import replace

import bpy
import numpy as np

from ..core.groom import GuideSettings, HairSettings
from ..core.params import declared, label_of
from ..core.picture import PassSettings, RenderSettings
from ..core.shading import appearance, lookup_tables
from ..core.shading.appearance import Appearance
from .translations import CONTEXT

_RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"}  # paths may begin with //

MODELS = (
    ("KAJIYA_KAY", "Kajiya-Kay", "An opaque cylinder: a diffuse part and one highlight"),
    ("MARSCHNER", "Marschner", "A glass fibre: reflection, transmission and internal reflection from baked tables"),
)


def annotations(settings_class, update=None, skip=()):
    """{name: bpy property} for the fields of a `Settings` class but those of `skip`; `update` as in bpy.props."""
    return {
        name: _property(name, default, details, update)
        for name, default, details in declared(settings_class)
        if name not in skip
    }


def _property(name, default, details, update):
    common = {"name": _title(label_of(name, details)), "description": details.description, "default": default}
    common["translation_context"] = CONTEXT
    if update is not None:
        common["update"] = update
    if isinstance(default, str):
        if details.choices:
            return bpy.props.EnumProperty(items=details.choices, **common)
        return bpy.props.StringProperty(**common)
    if isinstance(default, bool):
        return bpy.props.BoolProperty(**common)
    limits = _limits(details, isinstance(default, int))
    if isinstance(default, int):
        return bpy.props.IntProperty(**common, **limits)
    limits["precision"] = details.precision
    if isinstance(default, tuple):
        return bpy.props.FloatVectorProperty(size=len(default), subtype=details.subtype, **common, **limits)
    # A subtype such as DISTANCE or ANGLE implies its unit.
    return bpy.props.FloatProperty(subtype=details.subtype, unit=details.unit, **common, **limits)


def _title(label):
    """A label as Blender writes them: Melanin Redness, IOR."""
    return " ".join(word[:1].upper() + word[1:] for word in label.split())


def _limits(details, is_integer):
    # Blender has no exclusive limit; ten nanometres stand for "above zero".
    low = max(details.low, details.above + 1e-8) if math.isfinite(details.above) else details.low
    limits = {"min": low, "max": details.high, "soft_max": min(details.soft_high, details.high)}
    finite = {key: value for key, value in limits.items() if math.isfinite(value)}
    return {key: int(value) for key, value in finite.items()} if is_integer else finite


def to_settings(owner, settings_class, skip=()):
    """The `Settings` that an operator or property group holds, those of `skip` at their defaults.

    Raises `HairError` for what the range forbids.
    """
    values = {
        name: _plain(getattr(owner, name), default, details)
        for name, default, details in declared(settings_class)
        if name not in skip
    }
    return settings_class(**values)


def _plain(value, default, details):
    """A property's value as it was meant: single precision gives 0.15 back as 0.15000000596."""
    if isinstance(default, float):
        # A default or a limit such as 15° in radians has no short decimal, and rounded up it would be out of range.
        for meant in (default, details.low, details.high):
            if np.float32(meant) == np.float32(value):
                return meant
        return float(str(np.float32(value)))  # the shortest decimal is what somebody typed
    if isinstance(default, tuple):
        return tuple(_plain(float(part), meant, details) for part, meant in zip(value, default, strict=True))
    return value


def names_of(settings_class):
    """Names of the settings of a class, in the order of declaration."""
    return tuple(name for name, _default, _details in declared(settings_class))


def look_of(state):
    """The `Appearance` of a hair; state: its `VellusCurves`. Raises `HairError`."""
    return to_settings(state.appearance, Appearance)


def own_table_settings_of(state):
    """The `lookup_tables.Settings` of a hair, those at their defaults that follow from its look. Raises `HairError`."""
    return to_settings(state.marschner, lookup_tables.Settings, skip=appearance.TABLE_FIELDS)


def table_settings_of(state):
    """The `lookup_tables.Settings` that the Marschner model shades a hair with. Raises `HairError`."""
    settings = appearance.table_settings(look_of(state), own_table_settings_of(state))
    # As an operator's properties hold them, so that tables it baked of these settings have the same ones.
    return replace(
        settings,
        **{
            name: _plain(getattr(settings, name), default, details)
            for name, default, details in declared(lookup_tables.Settings)
        },
    )


def assign(owner, settings, skip=()):
    """Write `Settings` into an operator's or group's properties, but for those of `skip`."""
    for name, _default, _details in declared(type(settings)):
        if name not in skip:
            setattr(owner, name, getattr(settings, name))


def _mark_geometry(group, _context):
    group.id_data.vellus.is_stale = True
    group.id_data.update_tag()


def _renew_passes(_group, context):
    context.view_layer.update_render_passes()


def _mark_shading(group, _context):
    group.id_data.vellus.is_shading_stale = True
    group.id_data.update_tag()


class VellusGuideSettings(bpy.types.PropertyGroup):
    """How guides were distributed"""

    __annotations__ = annotations(GuideSettings, _mark_geometry)


class VellusHairSettings(bpy.types.PropertyGroup):
    """How hair was grown between guides"""

    __annotations__ = annotations(HairSettings, _mark_geometry)


class VellusAppearance(bpy.types.PropertyGroup):
    """How hair looks, in the viewport and in Cycles"""

    __annotations__ = annotations(Appearance, _mark_shading)


class VellusMarschnerSettings(bpy.types.PropertyGroup):
    """How the Marschner model's tables are baked, beside what the appearance says"""

    __annotations__ = annotations(lookup_tables.Settings, _mark_shading, skip=appearance.TABLE_FIELDS)


class VellusCurves(bpy.types.PropertyGroup):
    """What Vellus knows of a Curves datablock"""

    kind: bpy.props.EnumProperty(
        items=[
            ("NONE", "None", "Not made by Vellus"),
            ("GUIDES", "Guides", "Guides that hair follows"),
            ("HAIR", "Hair", "Strands between guides"),
        ],
        default="NONE",
    )
    guide_curves: bpy.props.PointerProperty(
        name="Guides",
        description="The guides that this hair follows",
        translation_context=CONTEXT,
        type=bpy.types.Curves,
        poll=lambda _group, curves: curves.vellus.kind == "GUIDES",
        update=_mark_geometry,
    )
    guides: bpy.props.PointerProperty(type=VellusGuideSettings)
    hair: bpy.props.PointerProperty(type=VellusHairSettings)
    model: bpy.props.EnumProperty(
        name="Shading Model",
        description="How strands scatter light in the viewport",
        translation_context=CONTEXT,
        items=MODELS,
        default="MARSCHNER",
        update=_mark_shading,
    )
    appearance: bpy.props.PointerProperty(type=VellusAppearance)
    marschner: bpy.props.PointerProperty(type=VellusMarschnerSettings)
    table_folder: bpy.props.StringProperty(
        name="Table Folder",
        description="Folder with baked tables; they are used while their settings are those of this hair",
        translation_context=CONTEXT,
        subtype="DIR_PATH",
        options=_RELATIVE,
        update=_mark_shading,
    )
    is_drawn: bpy.props.BoolProperty(
        name="Shaded in Viewport",
        description="Draw this hair with its shading model; off: as Blender draws curves",
        translation_context=CONTEXT,
        default=True,
        update=_mark_shading,
    )
    viewport_percentage: bpy.props.IntProperty(
        name="Strands in Viewport",
        description="How many of the strands viewports show, each as much thicker; renders show all",
        translation_context=CONTEXT,
        subtype="PERCENTAGE",
        min=1,
        max=100,
        default=100,
    )
    is_live: bpy.props.BoolProperty(
        name="Live",
        description="Make this again whenever its settings or its inputs change",
        translation_context=CONTEXT,
        default=True,
    )
    is_stale: bpy.props.BoolProperty(default=False, options={"HIDDEN"})
    is_shading_stale: bpy.props.BoolProperty(default=False, options={"HIDDEN"})
    topology: bpy.props.StringProperty(description="The triangles that roots are stored by", options={"HIDDEN"})
    root_key: bpy.props.StringProperty(description="What the roots were placed by", options={"HIDDEN"})
    parting_key: bpy.props.StringProperty(description="What the hair was parted by", options={"HIDDEN"})
    written: bpy.props.StringProperty(description="Fingerprint of the points as they were made", options={"HIDDEN"})
    followed: bpy.props.StringProperty(description="The guides that the strands were written for", options={"HIDDEN"})
    shading_status: bpy.props.StringProperty(description="Why this cannot be shaded", options={"HIDDEN"})
    uv_status: bpy.props.StringProperty(description="What is wrong with the surface's UV map", options={"HIDDEN"})
    status: bpy.props.StringProperty(description="Why this could not be made again", options={"HIDDEN"})


class VellusRenderSettings(bpy.types.PropertyGroup):
    """How Vellus renders a scene"""

    __annotations__ = annotations(RenderSettings)


class VellusPassSettings(bpy.types.PropertyGroup):
    """Which passes Vellus renders of a view layer"""

    __annotations__ = annotations(PassSettings, _renew_passes)


CLASSES = (
    VellusGuideSettings,
    VellusHairSettings,
    VellusAppearance,
    VellusMarschnerSettings,
    VellusCurves,
    VellusRenderSettings,
    VellusPassSettings,
)


def register():
    """Attach the settings to every Curves datablock, scene and view layer."""
    bpy.types.Curves.vellus = bpy.props.PointerProperty(type=VellusCurves)
    bpy.types.Scene.vellus = bpy.props.PointerProperty(type=VellusRenderSettings)
    bpy.types.ViewLayer.vellus = bpy.props.PointerProperty(type=VellusPassSettings)


def unregister():
    """Take them away again; what is stored in files stays there."""
    del bpy.types.ViewLayer.vellus
    del bpy.types.Scene.vellus
    del bpy.types.Curves.vellus


def values_of(owner, names):
    """{name: value} of an operator's or group's properties, as they are and to be compared."""
    values = {name: getattr(owner, name) for name in names}
    return {n: value[:] if isinstance(value, bpy.types.bpy_prop_array) else value for n, value in values.items()}


def copy(source, target, settings_class):
    """Copy the properties of a `Settings` class from one owner to another, as they are."""
    for name, _default, _details in declared(settings_class):
        setattr(target, name, getattr(source, name))


def folder(description):
    """The `directory` property that a file browser fills."""
    return bpy.props.StringProperty(
        name="Folder", description=description, subtype="DIR_PATH", options=_RELATIVE, translation_context=CONTEXT
    )


def file(description):
    """The `filepath` property that a file browser fills."""
    return bpy.props.StringProperty(
        name="File", description=description, subtype="FILE_PATH", options=_RELATIVE, translation_context=CONTEXT
    )


def only_files(pattern):
    """The `filter_glob` property by which a file browser shows some files alone."""
    return bpy.props.StringProperty(default=pattern, options={"HIDDEN"})


def text(name, description):
    """A line of text that is no setting."""
    return bpy.props.StringProperty(name=name, description=description, translation_context=CONTEXT)


def choice(name, description, labels):
    """An enumeration that is no setting; labels: {identifier: label}."""
    items = [(identifier, label, "") for identifier, label in labels.items()]
    return bpy.props.EnumProperty(name=name, description=description, items=items, translation_context=CONTEXT)
