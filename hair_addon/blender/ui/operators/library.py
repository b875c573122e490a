# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that save grooms to asset libraries and apply them to meshes."""

from pathlib import Path

import bpy

from ....core.errors import HairError
from ... import io
from ...groom.selection import hair_of, make_active, object_of, surface_of
from ...groom.transfer import library_groom
from ...host import paths
from ...host.notices import name_of
from ...settings import asset_libraries, properties
from ...settings.translations import report_text
from .base.file_browser import BrowsedOperator
from .base.hair_operator import HairOperator, needs_hair
from .base.modal import LongOperator


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
        folder = asset_libraries.folder_to_save(self.library)
        path = io.groom_library.path_of(folder, self.name or name_of(hair))
        if path.exists() and not self.overwrites:
            raise HairError("{path} exists: choose another name, or turn on Overwrite.", path=path)
        return io.groom_library.saving(hair, path, self.name, self.catalog)

    def message(self, made):
        return "Groom saved to {path}", {"path": made}

    def after(self, context, made):
        asset_libraries.show_changes(self.library or asset_libraries.first_name())


_METHODS = {"AUTO": "Automatic", "UV": "UV Map", "NEAREST": "Nearest Surface"}
_TOOLTIPS = {
    "AUTO": "At the saved places on a copy of the surface; by UV maps if they match; otherwise by the nearest surface",
    "UV": "Each guide keeps its UV coordinates",
    "NEAREST": "Each guide goes to the nearest surface after both meshes are aligned",
}


class VELLUS_OT_apply_groom(BrowsedOperator, bpy.types.Operator):
    """Apply a groom from an asset library to the active mesh, as new guides and hair"""

    bl_idname = "vellus.apply_groom"
    bl_label = "Apply Groom"
    __annotations__ = {
        "filepath": properties.file("File of an asset library, .blend"),
        "filter_glob": properties.only_files("*.blend"),
        "name": properties.text("Name", "Groom to apply, if the file has several"),
        "method": properties.choice("Method", "How guides are placed on the mesh", _METHODS, _TOOLTIPS),
        **asset_libraries.reference(),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow hair on.")
        return surface_of(context.object) is not None

    def invoke(self, context, event):
        """Use the asset of the context, or open the file browser."""
        asset = getattr(context, "asset", None)
        try:
            found = asset_libraries.referenced(self)
        except HairError as error:
            return self.refuse(error)
        if found is None and asset is not None and asset.full_library_path:
            found = Path(asset.full_library_path), asset.name
        if found is not None:
            self.filepath, self.name = str(found[0]), found[1]
        return super().invoke(context, event)

    def seconds(self, context):
        return float("inf")  # the counts are in the file

    def work(self, context):
        found = asset_libraries.referenced(self) or (paths.resolve(self.filepath), self.name)
        groom = io.groom_library.read(*found)
        surface, depsgraph = surface_of(context.object), context.evaluated_depsgraph_get()
        return library_groom.adding_groom(surface, groom, depsgraph, self.method)

    def message(self, made):
        counts = {"guide_count": len(made.made.guides.curves), "strand_count": len(made.made.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        context.view_layer.update()
        make_active(object_of(made.made.hair, context.view_layer), context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))


class VELLUS_OT_add_grooms(HairOperator, bpy.types.Operator):
    """Add the grooms that come with Vellus to the asset libraries of the preferences, and show the asset shelf"""

    bl_idname = "vellus.add_grooms"
    bl_label = "Add Vellus Grooms"
    bl_options = {"REGISTER"}

    def change(self, context):
        name = asset_libraries.add_shipped()
        asset_libraries.show_changes(name)
        if context.area is not None and context.area.type == "VIEW_3D":
            context.area.spaces.active.show_region_asset_shelf = True
        return "The asset library {name} contains the grooms that come with Vellus", {"name": name}


CLASSES = (
    VELLUS_OT_save_groom,
    VELLUS_OT_apply_groom,
    VELLUS_OT_add_grooms,
)
