# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner settings → the model's tables as OpenEXR files."""

import bpy

from .....core.grooming import cost
from .....core.shading.tables import lookup_tables
from ....groom.selection import hair_of
from ....host import paths
from ....host.datablocks import Remembered
from ....io import table_files
from ....settings import properties, setting_properties
from ..base.file_browser import BrowsedOperator


class VELLUS_OT_bake_tables(BrowsedOperator, bpy.types.Operator):
    """Bake the active hair's Marschner lookup tables to a folder and use them while the settings match"""

    bl_idname = "vellus.bake_tables"
    bl_label = "Bake Lookup Tables"
    __annotations__ = {
        "directory": properties.folder("Folder to write the lookup tables to"),
        **setting_properties.annotations(lookup_tables.Settings),
    }
    asked = "directory"

    @classmethod
    def applies(cls, _context):
        return True  # to no hair too

    def prefill(self, context):
        """Fill unset properties with the settings of the hair, if there is one."""
        hair = hair_of(context.object)
        if hair is None:
            return
        settings = properties.table_settings_of(hair.vellus)
        for name in setting_properties.names_of(lookup_tables.Settings):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))

    def seconds(self, context):
        return cost.table_seconds(self.size)

    def work(self, context):
        hair = Remembered(hair_of(context.object))
        settings = setting_properties.to_settings(self, lookup_tables.Settings)
        folder, named = paths.resolve(self.directory), self.directory
        yield from table_files.baking_tables(settings, folder)
        target = hair.find()
        if target is not None:
            target.vellus.table_folder = named
        return folder

    def message(self, made):
        return "Lookup tables written to {folder}", {"folder": made}
