# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of a file → hair or guides on the active mesh, by Vellus' own readers."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .....core.errors import HairError
from .....core.files.curve_file import UNITS, Convention
from .....core.grooming.derived_guides import DerivationSettings
from .....core.grooming.groom import HairSettings
from .....core.long_work import Stage, no_progress
from .... import io
from ....groom.foreign import hand_made_guides, kept_hair
from ....groom.selection import make_active, object_of, surface_of
from ....host import paths
from ....host.datablocks import Remembered
from ....settings import properties, setting_properties
from ....settings.translations import error_text, report_text
from ... import setting_rows
from ..base.file_browser import BrowsedOperator

_FOUND = "AUTO"
_UNIT_NAMES = {
    "m": "Meters",
    "cm": "Centimeters",
    "mm": "Millimeters",
    "in": "Inches",
    "ft": "Feet",
    "km": "Kilometers",
}


@dataclass(frozen=True)
class _Imported:
    """What was made of the curves, and sentences to tell the artist."""

    made: Any
    notes: list[HairError]


class VELLUS_OT_import_groom(BrowsedOperator, bpy.types.Operator):
    """Read hair or guides for the active mesh from a file: Alembic, USD, or arrays"""

    bl_idname = "vellus.import_groom"
    bl_label = "Import Groom"
    __annotations__ = {
        "filepath": properties.file("File to read, .abc, .usd, .usdc, .usda, .usdz or .npz"),
        "filter_glob": properties.only_files("*.abc;*.usd;*.usdc;*.usda;*.usdz;*.npz"),
        "kind": properties.choice(
            "Import As",
            "What the curves become. Of a groom, which has both, hair brings its guides",
            {"HAIR": "Hair", "GUIDES": "Guides"},
        ),
        "object_name": properties.text("Object", "Object or group in the file. Leave empty for all curves"),
        "unit": properties.choice(
            "Unit",
            "Unit of the file's coordinates. Automatic takes what the file says, or what puts roots on the mesh",
            {_FOUND: "Automatic", **{name: _UNIT_NAMES[name] for name in UNITS}},
        ),
        "up": properties.choice(
            "Up",
            "Axis that points up in the file. Automatic takes what the file says, or what puts roots on the mesh",
            {_FOUND: "Automatic", "X": "X", "Y": "Y", "Z": "Z"},
        ),
        **setting_properties.annotations(DerivationSettings),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select the mesh that the hair grows on, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def draw(self, context):
        for name in ("kind", "object_name", "unit", "up"):
            setting_rows.row(self.layout, self.properties, name)
        column = self.layout.column()
        column.active = self.kind == "HAIR"
        setting_rows.row(column, self.properties, "guide_count")

    def seconds(self, context):
        return float("inf")  # how many curves there are is in the file

    def work(self, context):
        path, surface = paths.resolve(self.filepath), surface_of(context.object)
        said = Convention(UNITS.get(self.unit), None if self.up == _FOUND else self.up)
        plays = self.kind == "HAIR" and bool(bpy.data.filepath)
        wanted = io.curve_files.Wanted(self.kind, self.object_name, said, plays=plays)
        settings = setting_properties.given_settings(self, DerivationSettings)
        return _importing(path, wanted, surface, settings)

    def message(self, made):
        made = made.made
        if made.hair is None:
            return "{count} guides", {"count": len(made.guides.curves)}
        counts = {"guide_count": len(made.guides.curves), "strand_count": len(made.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        shown = object_of(made.made.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for note in made.notes:
            self.report({"WARNING"}, error_text(note))
        for sentence, values in made.made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))


def _importing(path, wanted, surface, settings):
    """Read a file and use its curves, as work in steps."""
    place = Remembered(surface)
    file = yield from io.curve_files.reading(path)
    surface = place.find()
    found = io.curve_files.made_of(path, file, wanted, surface)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if wanted.kind == "GUIDES":
        using = hand_made_guides.using_as_guides(found.curves, surface, depsgraph, hair_settings=HairSettings())
    else:
        using = kept_hair.using_as_hair(found.curves, surface, depsgraph, settings, guides_object=found.guides)
    made = yield from using
    if found.motion is not None:
        yield Stage("Writing frames", 0.9)
        beside = io.played_hair.path_beside(Path(bpy.data.filepath), made.hair)
        io.played_hair.playing(made.hair, found.motion, made.rooted.point_order(found.starts), beside)(no_progress)
    return _Imported(made, found.notes)
