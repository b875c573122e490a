# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair ↔ all settings that it was made with, as `settings_file.GroomSettings`."""

from ..core.groom import GuideSettings
from ..core.settings_file import GroomSettings
from ..core.shading.appearance import TABLE_FIELDS
from . import curves, looks, pipeline, properties


def settings_of(hair):
    """The `GroomSettings` of a hair Curves datablock and its guides. Raises `HairError`."""
    guides, hair_settings = pipeline.inputs_of(hair)
    guide_settings = properties.to_settings(guides.vellus.guides, GuideSettings)
    look, tables = properties.look_of(hair.vellus), properties.own_table_settings_of(hair.vellus)
    return GroomSettings(guide_settings, hair_settings, look, tables)


def apply_settings(hair, settings):
    """Give a hair Curves datablock and its guides other settings; what follows from them is made with Blender's update.

    Guides or hair that somebody combed stay as they are, as they do when a setting is changed by hand. Raises
    `HairError` before anything changes.
    """
    guides, _settings = pipeline.inputs_of(hair)
    for target in (guides, hair):
        curves.require_editable(target)
    for group, wanted in ((guides.vellus.guides, settings.guides), (hair.vellus.hair, settings.hair)):
        if properties.to_settings(group, type(wanted)) != wanted:  # or everything would be made again for nothing
            properties.assign(group, wanted)
    _assign_shading(hair, settings)


def assign_look(hair, look):
    """Give hair an `Appearance` with its mode, which a look alone leaves as it is. Raises `HairError`."""
    curves.require_editable(hair)
    hair.vellus.appearance.mode = look.mode
    looks.apply_look(hair, look)


def adding_hair(surface_object, settings, depsgraph):
    """Guides and hair of some `GroomSettings` on a mesh object, as work in steps; returns the Curves of both."""
    guides, hair = yield from pipeline.adding_hair(surface_object, settings.guides, settings.hair, depsgraph)
    _assign_shading(hair, settings)
    return guides, hair


def _assign_shading(hair, settings):
    properties.assign(hair.vellus.marschner, settings.tables, skip=TABLE_FIELDS)
    assign_look(hair, settings.appearance)
