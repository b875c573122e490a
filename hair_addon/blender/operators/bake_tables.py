# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner settings → M, N and N_TRT as OpenEXR files."""

import bpy

from ...core import exr
from ...core.errors import HairError
from ...core.shading import lookup_tables
from .. import files, properties
from ..selection import active_of_kind


class VELLUS_OT_bake_tables(bpy.types.Operator):
    """Bake the Marschner model's tables to a folder; the active hair reads them from there"""

    bl_idname = "vellus.bake_tables"
    bl_label = "Bake Tables"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "directory": properties.folder("Folder that m.exr, n.exr and n_trt.exr are written to"),
        **properties.annotations(lookup_tables.Settings),
    }

    def invoke(self, context, _event):
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            properties.copy(hair.vellus.marschner, self, lookup_tables.Settings)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        hair = active_of_kind(context.object, "HAIR")
        try:
            settings = properties.to_settings(self, lookup_tables.Settings)
            folder = files.resolve(self.directory)
            exr.write_tables(folder, lookup_tables.bake(settings), files.addon_version())
        except HairError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if hair is not None:
            properties.assign(hair.vellus.marschner, settings)
            hair.vellus.table_folder = self.directory
        self.report({"INFO"}, f"Tables written to {folder}")
        return {"FINISHED"}
