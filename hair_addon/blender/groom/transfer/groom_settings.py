# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair ↔ all of its settings, as `settings_file.GroomSettings`."""

from collections.abc import Sequence
from dataclasses import replace

from bpy.types import Curves, Depsgraph, Object

from ....core.dynamics.rod.settings import DynamicsSettings
from ....core.errors import HairError
from ....core.files.settings_file import GroomSettings
from ....core.grooming.groom import GuideSettings
from ....core.long_work import Work
from ....core.maps import ramp_text, varied_settings
from ....core.maps.map_settings import MapSettings
from ....core.shading.appearance import TABLE_FIELDS, Appearance
from ...data import scene, whole_changes
from ...data.strands import curves
from ...materials import looks
from ...settings import animated, fitted_sizes, map_items, properties, ramp_nodes, setting_properties, style_items
from .. import pipeline, size_fitting, writing
from ..foreign import hand_made_guides


def settings_of(hair: Curves) -> GroomSettings:
    """Return the `GroomSettings` of a hair Curves datablock and its guides. Raises `HairError`."""
    guides, hair_settings = pipeline.inputs_of(hair)
    guide_settings = setting_properties.to_settings(guides.vellus.guides, GuideSettings)
    look, tables = properties.own_look_of(hair.vellus), properties.own_table_settings_of(hair.vellus)
    styles, names = style_items.styles_of(hair.vellus), style_items.names_of(hair.vellus)
    dynamics = properties.own_dynamics_of(guides.vellus)
    maps = maps_of(hair)
    curve = ramp_nodes.text_of(hair.vellus.thickness_ramp)
    return GroomSettings(guide_settings, hair_settings, look, tables, styles, names, dynamics, maps, curve)


def apply_settings(hair: Curves, settings: GroomSettings) -> None:
    """Apply settings to a hair Curves datablock and its guides; Blender's next update regenerates them.

    Combed guides and hair do not change, as with any change of settings. Unset values are fitted to the surface, and
    unchanged ones stay fitted. Raises `HairError` before anything changes.
    """
    guides, _settings = pipeline.inputs_of(hair)
    for target in (guides, hair):
        curves.require_editable(target)
    depsgraph = scene.present_depsgraph()
    of_guides, of_hair = pipeline.complete(guides.surface, settings.guides, settings.hair, depsgraph)
    groups = (guides.vellus.guides, settings.guides, of_guides), (hair.vellus.hair, settings.hair, of_hair)
    for group, given, wanted in groups:
        fits = size_fitting.unchanged_sizes(group, given) | fitted_sizes.open_names(given)
        # Otherwise everything would be regenerated unnecessarily.
        if setting_properties.to_settings(group, type(wanted)) != wanted:
            setting_properties.assign(group, wanted)
        fitted_sizes.keep_flags(group, {name: name in fits for name in fitted_sizes.fitted(type(given))})
    assign_dynamics(guides, settings.dynamics)
    style_items.assign(hair.vellus, settings.styles, settings.style_names)
    _assign_shading(hair, settings)


def has_unsaved_changes(hair: Curves) -> bool:
    """Whether settings of a library override differ from those of its file, as after a script: Blender does not save
    them. Dynamics and settings of other guides are saved, and keyed settings are those of the frame.
    """
    reference = None if hair.override_library is None else hair.override_library.reference
    if reference is None or any(
        one is not None and animated.are_keyed(one) for one in (hair, hair.vellus.guide_curves)
    ):
        return False
    try:
        own, of_file = (replace(settings_of(one), dynamics=DynamicsSettings()) for one in (hair, reference))
    except HairError:  # the hair's status says so
        return False
    guides = hair.vellus.guide_curves.override_library
    if guides is None or guides.reference != reference.vellus.guide_curves:
        own = replace(own, guides=of_file.guides)
    return own != of_file


def assign_look(hair: Curves, look: Appearance) -> None:
    """Assign an `Appearance` including its mode, which looks do not change. Raises `HairError`."""
    curves.require_editable(hair)
    hair.vellus.appearance.mode = look.mode
    looks.apply_look(hair, look)


def assign_dynamics(guides: Curves, settings: DynamicsSettings) -> None:
    """Assign simulation settings to guide Curves; equal settings mark nothing stale. Raises `HairError`."""
    curves.require_overridable(guides)
    if properties.own_dynamics_of(guides.vellus) != setting_properties.as_stored(settings):
        setting_properties.assign(guides.vellus.dynamics, settings)


@whole_changes.whole
def adding_hair(surface_object: Object, settings: GroomSettings, depsgraph: Depsgraph) -> Work[tuple[Curves, Curves]]:
    """Grow guides and hair with `GroomSettings` on a mesh object, as work in steps; returns the Curves of both."""
    growing = pipeline.adding_hair(surface_object, settings.guides, settings.hair, depsgraph, settings.styles)
    guides, hair = yield from growing
    writing.keep_styles(hair, settings.styles, settings.style_names)
    assign_dynamics(guides, settings.dynamics)
    _assign_shading(hair, settings)
    return guides, hair


@whole_changes.whole
def using_as_guides(
    curves_object: Object, surface_object: Object, settings: GroomSettings, depsgraph: Depsgraph
) -> Work[hand_made_guides.HandMade]:
    """Convert an object's curves to guides with hair of `GroomSettings`, as work in steps; returns `HandMade`."""
    made = yield from hand_made_guides.using_as_guides(
        curves_object, surface_object, depsgraph, hair_settings=settings.hair
    )
    assign_dynamics(made.guides, settings.dynamics)
    if made.hair is not None:
        style_items.assign(made.hair.vellus, settings.styles, settings.style_names)
        _assign_shading(made.hair, settings)
        # Styled after the guides exist, as their attributes may be masks.
        pipeline.evaluate(made.hair, scene.present_depsgraph())
    return made


def assign_thickness_curve(hair: Curves, text: str) -> None:
    """Give hair Curves the thickness curve of a text, or none for an empty text; an equal one marks nothing stale.

    Raises `HairError` before anything changes.
    """
    curves.require_editable(hair)
    ramp_text.require_curve(text)
    before = hair.vellus.thickness_ramp
    wanted = ramp_nodes.replaced(before, hair, "Thickness", text)
    if wanted != before:
        hair.vellus.thickness_ramp = wanted
        ramp_nodes.remove_unused(before)


def maps_of(hair: Curves) -> tuple[MapSettings, ...]:
    """Return the maps of hair Curves and of their guides. Raises `HairError`."""
    guides = hair.vellus.guide_curves
    return (*(() if guides is None else map_items.maps_of(guides.vellus)), *map_items.maps_of(hair.vellus))


def assign_maps(hair: Curves, maps: Sequence[MapSettings]) -> None:
    """Replace the maps of hair Curves and of their guides; combed guides do not change.

    Raises `HairError` before anything changes.
    """
    of_guides = [one for one in maps if varied_settings.is_of_guides(one.setting)]
    for one in maps:
        varied_settings.require_map(one)
    guides = hair.vellus.guide_curves
    if guides is not None and guides.is_editable:
        was_stale = guides.vellus.is_stale
        map_items.assign(guides.vellus, of_guides)
        if curves.is_combed(guides):
            guides.vellus.is_stale = was_stale
    map_items.assign(hair.vellus, [one for one in maps if not varied_settings.is_of_guides(one.setting)])


def _assign_shading(hair, settings):
    assign_thickness_curve(hair, settings.thickness_curve)
    assign_maps(hair, settings.maps)
    setting_properties.assign(hair.vellus.marschner, settings.tables, skip=TABLE_FIELDS)
    assign_look(hair, settings.appearance)
