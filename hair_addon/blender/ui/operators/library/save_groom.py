# SPDX-License-Identifier: GPL-3.0-or-later
"""The active hair and its guides → an asset of an asset library."""

import bpy

from .....core.errors import HairError
from ....groom.selection import hair_of
from ....host.notices import name_of
from ....io import groom_library
from ....settings import asset_libraries, properties
from ..base.hair_operator import needs_hair
from ..base.modal import LongOperator


class VELLUS_OT_save_groom(LongOperator, bpy.types.Operator):
    """Save the active hair with its guides, masks, styles and look as an asset, to apply it to other meshes"""

    bl_idname = "vellus.save_groom"
    bl_label = "Save Groom to Library"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "name": properties.text("Name", "Name of the groom. Leave empty to use the name of the hair"),
        "library": asset_libraries.library_name("Library", "Asset library to save to"),
        "catalog": properties.text("Catalog", "Catalog of the groom, such as Hair/Short. Leave empty for none", True),
        "overwrites": properties.switch("Overwrite", "Replace a groom of the same name", False),
    }
    applies = needs_hair

    def invoke(self, context, _event):
        if not self.library:
            self.library = asset_libraries.first_name()
        if not self.name:
            self.name = name_of(hair_of(context.object))
        return context.window_manager.invoke_props_dialog(self)

    def seconds(self, context):
        return float("inf")  # graphics drivers differ a hundredfold

    def work(self, context):
        hair = hair_of(context.object)
        folder = asset_libraries.folder_of(self.library or asset_libraries.first_name())
        path = groom_library.path_of(folder, self.name or name_of(hair))
        if path.exists() and not self.overwrites:
            raise HairError("{path} exists: choose another name, or turn on Overwrite.", path=path)
        return groom_library.saving(hair, path, self.name, self.catalog)

    def message(self, made):
        return "Groom saved to {path}", {"path": made}

    def after(self, context, made):
        asset_libraries.show_changes(self.library or asset_libraries.first_name())
