# SPDX-License-Identifier: GPL-3.0-or-later
"""The active hair's settings, and those of its guides → a file."""

import bpy

from .....core.errors import HairError
from .....core.files import settings_file
from .....core.long_work import Stage
from ....groom.selection import hair_of
from ....groom.transfer import groom_settings
from ....host import paths
from ....settings import properties
from ..base.file_browser import BrowsedOperator
from ..base.hair_operator import needs_hair


class VELLUS_OT_save_groom_settings(BrowsedOperator, bpy.types.Operator):
    """Save the settings of the active hair and its guides to a file, for other hair, scripts, and the command line"""

    bl_idname = "vellus.save_groom_settings"
    bl_label = "Save Groom Settings"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("Settings file to write, .json"),
        "filter_glob": properties.only_files("*.json"),
    }
    asked = "filepath"
    applies = needs_hair

    def seconds(self, context):
        return 0.0

    def work(self, context):
        path = paths.resolve(self.filepath)
        path = path if path.suffix else path.with_suffix(".json")
        hair = hair_of(context.object)
        if hair is None:
            raise HairError("Select hair.")
        settings = groom_settings.settings_of(hair)
        yield Stage("Writing settings", 0.5)
        settings_file.write(path, settings)
        return path

    def message(self, made):
        return "Settings written to {path}", {"path": made}
