# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner settings → the model's tables as OpenEXR files."""

import bpy

from ...core import estimate
from ...core.shading import lookup_tables
from .. import files, properties, table_files
from ..datablocks import Remembered
from ..selection import hair_of
from .file_browser import BrowsedOperator


class VELLUS_OT_bake_tables(BrowsedOperator, bpy.types.Operator):
    """Bake the active hair's Marschner tables to a folder, from which it reads them while its settings stay"""

    bl_idname = "vellus.bake_tables"
    bl_label = "Bake Tables"
    __annotations__ = {
        "directory": properties.folder("Folder that the tables are written to"),
        **properties.annotations(lookup_tables.Settings),
    }
    asked = "directory"

    def prefill(self, context):
        """Fill what was not asked for with the settings of the hair, if there is one."""
        hair = hair_of(context.object)
        if hair is None:
            return
        settings = properties.table_settings_of(hair.vellus)
        for name in properties.names_of(lookup_tables.Settings):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))

    def seconds(self, context):
        return estimate.table_seconds(properties.to_settings(self, lookup_tables.Settings))

    def work(self, context):
        hair = Remembered(hair_of(context.object))
        settings = properties.to_settings(self, lookup_tables.Settings)
        folder, named = files.resolve(self.directory), self.directory
        yield from table_files.baking_tables(settings, folder)
        target = hair.find()
        if target is not None:
            target.vellus.table_folder = named
        return folder

    def message(self, made):
        return "Tables written to {folder}", {"folder": made}
