# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of the active object and its guides → a file for engines and other programs."""

import bpy

from .....core.files.export_settings import ExportSettings
from ....host import paths
from ....io import groom_export, groom_sources
from ....settings import properties, setting_properties
from ....settings.translations import error_text
from ..base.file_browser import BrowsedOperator
from ..base.hair_operator import needs_hair


class VELLUS_OT_export_groom(BrowsedOperator, bpy.types.Operator):
    """Write the hair on the active mesh and its guides to a file: Alembic as Unreal imports grooms, or USD"""

    bl_idname = "vellus.export_groom"
    bl_label = "Export Groom"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("File to write, .abc or .usd, .usdc, .usda"),
        "filter_glob": properties.only_files("*.abc;*.usd;*.usdc;*.usda"),
        **setting_properties.annotations(ExportSettings),
    }
    asked = "filepath"
    applies = needs_hair

    def seconds(self, context):
        return float("inf")  # how long an animation takes is not known

    def work(self, context):
        path = paths.resolve(self.filepath)
        path = path if path.suffix else path.with_suffix(".abc")
        settings = setting_properties.to_settings(self, ExportSettings)
        return groom_export.exporting(path, groom_sources.hair_on(context.object), settings, context.scene)

    def after(self, context, made):
        for note in made.notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"guide_count": made.guides, "strand_count": made.strands, "path": made.path}
        return "{guide_count} guides and {strand_count} strands written to {path}", counts
