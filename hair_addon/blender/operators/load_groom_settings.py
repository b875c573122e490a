# SPDX-License-Identifier: GPL-3.0-or-later
"""A file of settings → the active hair and its guides, or new hair on the active mesh."""

import bpy

from ...core import settings_file
from ...core.long_work import Stage
from .. import files, groom_settings, properties
from ..selection import hair_of, make_active, object_of
from .file_browser import BrowsedOperator


class VELLUS_OT_load_groom_settings(BrowsedOperator, bpy.types.Operator):
    """Give the active hair and its guides the settings of a file; on a mesh without hair, grow some"""

    bl_idname = "vellus.load_groom_settings"
    bl_label = "Load Groom Settings"
    __annotations__ = {
        "filepath": properties.file("File of groom settings, .json"),
        "filter_glob": properties.only_files("*.json"),
    }
    asked = "filepath"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select hair, or a mesh to grow hair on.")
        active = context.object
        return active is not None and (active.type == "MESH" or hair_of(active) is not None)

    def seconds(self, context):
        return float("inf")  # the file says how much there is to grow

    def work(self, context):
        settings = settings_file.read(files.resolve(self.filepath))
        hair = hair_of(context.object)
        if hair is None:
            depsgraph = context.evaluated_depsgraph_get()
            _guides, hair = yield from groom_settings.adding_hair(context.object, settings, depsgraph)
            return hair
        groom_settings.apply_settings(hair, settings)
        yield Stage("Applying settings", 1.0)
        return hair

    def message(self, made):
        return "Settings given to {name}", {"name": made.name}

    def after(self, context, made):
        context.view_layer.update()  # strands are made again here, and new objects become known
        make_active(object_of(made, context.view_layer), context.view_layer)
