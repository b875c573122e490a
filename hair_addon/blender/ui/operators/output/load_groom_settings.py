# SPDX-License-Identifier: GPL-3.0-or-later
"""A file of settings → the active hair and its guides, or new hair on the active mesh."""

import bpy

from .....core.files import settings_file
from .....core.long_work import Stage
from ....groom.selection import hair_of, make_active, object_of
from ....groom.transfer import groom_settings
from ....host import paths
from ....settings import properties
from ..base.file_browser import BrowsedOperator


class VELLUS_OT_load_groom_settings(BrowsedOperator, bpy.types.Operator):
    """Apply the settings of a file to the active hair and its guides; on a mesh without hair, create a hair system"""

    bl_idname = "vellus.load_groom_settings"
    bl_label = "Load Groom Settings"
    __annotations__ = {
        "filepath": properties.file("Groom settings file, .json"),
        "filter_glob": properties.only_files("*.json"),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair, or a mesh to grow hair on.")
        active = context.object
        return active is not None and (active.type == "MESH" or hair_of(active) is not None)

    def seconds(self, context):
        return float("inf")  # the counts are in the file

    def work(self, context):
        settings = settings_file.read(paths.resolve(self.filepath))
        hair = hair_of(context.object)
        if hair is None:
            depsgraph = context.evaluated_depsgraph_get()
            _guides, hair = yield from groom_settings.adding_hair(context.object, settings, depsgraph)
            return hair
        groom_settings.apply_settings(hair, settings)
        yield Stage("Applying settings", 1.0)
        return hair

    def message(self, made):
        return "Settings applied to {name}", {"name": made.name}

    def after(self, context, made):
        context.view_layer.update()  # regenerates strands, and evaluates new objects
        make_active(object_of(made, context.view_layer), context.view_layer)
