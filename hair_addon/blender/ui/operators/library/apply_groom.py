# SPDX-License-Identifier: GPL-3.0-or-later
"""A groom of an asset library → guides and hair on the active mesh."""

from pathlib import Path

import bpy

from .....core.errors import HairError
from ....groom.selection import make_active, object_of, surface_of
from ....groom.transfer import library_groom
from ....host import paths
from ....io import groom_library
from ....settings import asset_libraries, properties
from ....settings.translations import report_text
from ..base.file_browser import BrowsedOperator

_METHODS = {"AUTO": "Automatic", "UV": "UV Map", "NEAREST": "Nearest Surface"}
_TOOLTIPS = {
    "AUTO": "As saved on a copy of the surface; by UV maps if they agree; else by the nearest surface",
    "UV": "Each guide keeps its UV coordinates",
    "NEAREST": "Each guide goes to the nearest surface when both meshes are laid over each other",
}


class VELLUS_OT_apply_groom(BrowsedOperator, bpy.types.Operator):
    """Put a groom from an asset library on the active mesh, as new guides and hair"""

    bl_idname = "vellus.apply_groom"
    bl_label = "Apply Groom"
    __annotations__ = {
        "filepath": properties.file("File of an asset library, .blend"),
        "filter_glob": properties.only_files("*.blend"),
        "name": properties.text("Name", "Groom to apply, if the file has several"),
        "method": properties.choice("Method", "How guides find their places on the mesh", _METHODS, _TOOLTIPS),
        **asset_libraries.reference(),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow hair on.")
        return surface_of(context.object) is not None

    def invoke(self, context, event):
        """Take the asset that the operator was called for, or ask for a file."""
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
        groom = groom_library.read(*found)
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
