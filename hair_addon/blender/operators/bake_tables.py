# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner settings → the model's tables as OpenEXR files."""

import bpy

from ...core import exr
from ...core.errors import HairError
from ...core.shading import lookup_tables
from .. import files, properties
from ..selection import hair_of
from .base import HairOperator


class VELLUS_OT_bake_tables(HairOperator, bpy.types.Operator):
    """Bake the active hair's Marschner tables to a folder, from which it reads them while its settings stay"""

    bl_idname = "vellus.bake_tables"
    bl_label = "Bake Tables"
    __annotations__ = {
        "directory": properties.folder("Folder that the tables are written to"),
        **properties.annotations(lookup_tables.Settings),
    }

    def invoke(self, context, _event):
        try:
            self._take_from(hair_of(context.object))
        except HairError as error:
            return self.refuse(error)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def _take_from(self, hair):
        """Fill what was not asked for with the settings of the hair, if there is one."""
        if hair is None:
            return
        settings = properties.table_settings_of(hair.vellus)
        for name in properties.names_of(lookup_tables.Settings):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))

    def change(self, context):
        hair = hair_of(context.object)
        self._take_from(hair)
        settings = properties.to_settings(self, lookup_tables.Settings)
        folder = files.resolve(self.directory)
        exr.write_tables(folder, lookup_tables.bake(settings), files.addon_version())
        if hair is not None:
            hair.vellus.table_folder = self.directory
        return "Tables written to {folder}", {"folder": folder}
