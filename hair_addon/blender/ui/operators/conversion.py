# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that create guides or hair from curves, particles or the groom of another mesh."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ....core.errors import HairError
from ....core.files.curve_file import ENDINGS, UNITS, Convention
from ....core.grooming import cost
from ....core.grooming.derived_guides import DerivationSettings
from ....core.grooming.groom import HairSettings
from ....core.grooming.transfer_settings import TransferSettings
from ....core.long_work import Stage, no_progress
from ....core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from ... import io
from ...data import scene
from ...groom.foreign import foreign_meshes, hand_made_guides, joined_curves, kept_hair, particle_hair
from ...groom.foreign.foreign_curves import chosen, is_foreign, require_foreign
from ...groom.selection import guides_of, hair_of, make_active, object_of, surface_of
from ...groom.transfer import system_transfer
from ...host import paths
from ...host.datablocks import Remembered
from ...settings import properties, setting_properties
from ...settings.translations import error_text, report_text
from .. import setting_rows
from .base.file_browser import BrowsedOperator
from .base.hair_operator import HairOperator
from .base.modal import LongOperator


class VELLUS_OT_use_as_guides(LongOperator, bpy.types.Operator):
    """Use the selected curves as guides, unchanged, and grow hair that follows them. Several objects become one"""

    bl_idname = "vellus.use_as_guides"
    bl_label = "Use as Guides"
    __annotations__ = {
        "surface": properties.mesh_name("Surface", "Mesh that the curves grow on. Leave empty to use their surface"),
        "every": properties.count("Keep Every", "Keep one of every n curves; higher values keep fewer", 1),
        "applies_modifiers": properties.switch(
            "Apply Modifiers", "Use the curves with their modifiers applied; when off, use the original curves", True
        ),
        "grows_hair": properties.switch("Grow Hair", "Grow strands that follow the guides", True),
        **setting_properties.annotations(HairSettings),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select curves not created by Vellus, in Object Mode.")
        return context.mode == "OBJECT" and (is_foreign(context.object) or cls.may_be_redone(context))

    def draw(self, context):
        try:
            surface = self._surface(context)
        except HairError:
            surface = None
        setting_rows.row(self.layout, self.properties, "surface")
        for name in ("every", "applies_modifiers", "grows_hair"):
            setting_rows.row(self.layout, self.properties, name)
        if self.grows_hair:
            setting_rows.add_title(self.layout, "Strands")
            setting_rows.all_strand_rows(self.layout, self.properties, surface)

    def seconds(self, context):
        if not self.grows_hair:
            return 0.0
        face_count = scene.triangle_count(self._surface(context), context.view_layer)
        return cost.hair_seconds(self._hair_settings(), face_count)

    def work(self, context):
        require_foreign(context.object)
        surface, hair_settings = self._surface(context), self._hair_settings() if self.grows_hair else None

        def use(curves_object, applies_modifiers):
            return hand_made_guides.using_as_guides(
                curves_object,
                surface,
                context.evaluated_depsgraph_get(),
                every=self.every,
                applies_modifiers=applies_modifiers,
                hair_settings=hair_settings,
            )

        objects = chosen(context.object, context.selected_objects)
        return joined_curves.using(objects, surface, use, self.applies_modifiers)

    def message(self, made):
        if made.hair is None:
            return "{count} guides", {"count": len(made.guides.curves)}
        counts = {"guide_count": len(made.guides.curves), "strand_count": len(made.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        if made.hair is not None:
            setting_properties.show(self, made.hair.vellus.hair, HairSettings)
        shown = object_of(made.guides, context.view_layer)
        if shown is not None and context.object is None:  # one object of several
            make_active(shown, context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))

    def _hair_settings(self):
        return setting_properties.given_settings(self, HairSettings)

    def _surface(self, context):
        selected = [o for o in context.selected_objects if o != context.object]
        return hand_made_guides.find_surface(context.object, context.view_layer, selected, self.surface)


class VELLUS_OT_use_as_hair(LongOperator, bpy.types.Operator):
    """Use the selected curves as hair, unchanged, and derive guides from them. Several objects become one"""

    bl_idname = "vellus.use_as_hair"
    bl_label = "Use as Hair"
    __annotations__ = {
        "surface": properties.mesh_name("Surface", "Mesh that the curves grow on. Leave empty to use their surface"),
        **setting_properties.annotations(DerivationSettings),
        "applies_modifiers": properties.switch(
            "Apply Modifiers", "Use the curves with their modifiers applied; when off, use the original curves", True
        ),
        "follows_guides": properties.switch(
            "Follow Guides", "Replace the strands with strands on the same roots that follow the guides", False
        ),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select curves not created by Vellus, in Object Mode.")
        return context.mode == "OBJECT" and (is_foreign(context.object) or cls.may_be_redone(context))

    def draw(self, context):
        setting_rows.row(self.layout, self.properties, "surface")
        for name in ("guide_count", "applies_modifiers", "follows_guides"):
            setting_rows.row(self.layout, self.properties, name)

    def seconds(self, context):
        return 1.0  # takes noticeable time for any hair

    def work(self, context):
        require_foreign(context.object)
        surface, settings = self._surface(context), setting_properties.given_settings(self, DerivationSettings)

        def use(curves_object, applies_modifiers):
            return kept_hair.using_as_hair(
                curves_object,
                surface,
                context.evaluated_depsgraph_get(),
                settings,
                applies_modifiers=applies_modifiers,
                follows_guides=self.follows_guides,
            )

        objects = chosen(context.object, context.selected_objects)
        return joined_curves.using(objects, surface, use, self.applies_modifiers)

    def message(self, made):
        sentence = "{strand_count} strands, {guide_count} guides. Error: {mean:.1f}% of the length (95%: {high:.1f}%)"
        counts = {"strand_count": len(made.hair.curves), "guide_count": len(made.guides.curves)}
        return sentence, counts | {"mean": 100.0 * made.mean_error, "high": 100.0 * made.high_error}

    def after(self, context, made):
        shown = object_of(made.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))

    def _surface(self, context):
        selected = [o for o in context.selected_objects if o != context.object]
        return hand_made_guides.find_surface(context.object, context.view_layer, selected, self.surface)


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
    """Result of an import, and sentences to report."""

    made: Any
    notes: list[HairError]


class VELLUS_OT_import_groom(BrowsedOperator, bpy.types.Operator):
    """Read hair or guides for the active mesh from a file: Alembic, USD, arrays, or strands of other programs"""

    bl_idname = "vellus.import_groom"
    bl_label = "Import Groom"
    __annotations__ = {
        "filepath": properties.file("File to read, .abc, .usd*, .npz, .hair, .data, .bin, .ply, .obj or .tfx"),
        "filter_glob": properties.only_files(";".join(f"*{ending}" for ending in ENDINGS)),
        "kind": properties.choice(
            "Import As",
            "Type of the imported curves. Hair of a groom that has both is imported with its guides",
            {"HAIR": "Hair", "GUIDES": "Guides"},
        ),
        "object_name": properties.text("Object", "Object or group in the file. Leave empty for all curves"),
        "unit": properties.choice(
            "Unit",
            "Unit of the file's coordinates. Automatic uses the file's own unit, or one that puts roots on the mesh",
            {_FOUND: "Automatic", **{name: _UNIT_NAMES[name] for name in UNITS}},
        ),
        "up": properties.choice(
            "Up",
            "Axis that points up in the file. Automatic uses the file's own axis, or one that puts roots on the mesh",
            {_FOUND: "Automatic", "X": "X", "Y": "Y", "Z": "Z"},
        ),
        "by_group": properties.switch(
            "Groups as Systems", "Make a hair system of each group of a groom, instead of one of all groups", False
        ),
        **setting_properties.annotations(DerivationSettings),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select the mesh that the hair grows on, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def draw(self, context):
        for name in ("kind", "object_name", "by_group", "unit", "up"):
            setting_rows.row(self.layout, self.properties, name)
        column = self.layout.column()
        column.active = self.kind == "HAIR"
        setting_rows.row(column, self.properties, "guide_count")

    def seconds(self, context):
        return float("inf")  # the number of curves is in the file

    def work(self, context):
        path, surface = paths.resolve(self.filepath), surface_of(context.object)
        convention = Convention(UNITS.get(self.unit), None if self.up == _FOUND else self.up)
        plays = self.kind == "HAIR" and bool(bpy.data.filepath)
        wanted = io.curve_files.Wanted(self.kind, self.object_name, convention, plays=plays)
        settings = setting_properties.given_settings(self, DerivationSettings)
        return _importing(path, wanted, surface, settings, self.by_group)

    def message(self, made):
        counts = {"guide_count": sum(len(one.made.guides.curves) for one in made)}
        if made[0].made.hair is None:
            return "{count} guides", {"count": counts["guide_count"]}
        counts["strand_count"] = sum(len(one.made.hair.curves) for one in made)
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        shown = object_of(made[0].made.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for one in made:
            for note in one.notes:
                self.report({"WARNING"}, error_text(note))
            for sentence, values in one.made.notes():
                self.report({"WARNING"}, report_text(sentence, **values))


def _importing(path, wanted, surface, settings, by_group):
    """Read a file and use its curves, as work in steps; returns [`_Imported`] of each hair system."""
    place = Remembered(surface)
    file = yield from io.curve_files.reading(path)
    parts, made = [(file, wanted)], []
    if by_group:
        parts = io.curve_files.parts_of(path, file, wanted, place.find())
    for part, of_part in parts:
        made.append((yield from _using(path, part, of_part, place.find(), settings)))
    return made


def _using(path, file, wanted, surface, settings):
    """Use the curves of a read file, as work in steps; returns `_Imported`."""
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


class VELLUS_OT_convert_particles(HairOperator, bpy.types.Operator):
    """Convert the hair of the active mesh's particle system to hair or guides, and switch the system off"""

    bl_idname = "vellus.convert_particles"
    bl_label = "Convert Particle Hair"
    __annotations__ = {
        "use": properties.choice(
            "Convert To",
            "Type of curves to create from the hairs",
            {"HAIR": "Hair", "GUIDES": "Guides"},
            {
                "HAIR": "Keep the hairs as strands, and derive guides from them",
                "GUIDES": "Use the hairs as guides, and grow strands between them",
            },
        ),
        **setting_properties.annotations(DerivationSettings),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with particle hair, in Object Mode.")
        if context.mode != "OBJECT":
            return False
        return bool(particle_hair.systems_of(context.object)) or cls.may_be_redone(context)

    def draw(self, context):
        setting_rows.row(self.layout, self.properties, "use")
        if self.use == "HAIR":
            setting_rows.row(self.layout, self.properties, "guide_count")

    def change(self, context):
        settings = setting_properties.given_settings(self, DerivationSettings)
        used = particle_hair.convert(context.object, self.use, settings)
        context.view_layer.update()  # to include new objects
        shown = object_of(used.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in used.notes():
            self.report({"WARNING"}, report_text(sentence, **values))
        counts = {"guide_count": len(used.guides.curves), "strand_count": len(used.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts


class VELLUS_OT_mesh_to_hair(LongOperator, bpy.types.Operator):
    """Turn the active mesh of hair cards, tubes or solid locks into hair on the other selected mesh"""

    bl_idname = "vellus.mesh_to_hair"
    bl_label = "Mesh to Hair"
    __annotations__ = {
        "surface": properties.mesh_name(
            "Surface", "Mesh that the hair grows on. Leave empty to use the other selected mesh, or the parent"
        ),
        **setting_properties.annotations(MeshStrandSettings),
        **setting_properties.annotations(DerivationSettings),
        "hides_mesh": properties.switch("Hide Mesh", "Hide the mesh of cards in viewports and renders", True),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select the mesh that hair grows on, then the mesh of cards or tubes, in Object Mode.")
        active = context.object
        is_mesh = active is not None and active.type == "MESH"
        return context.mode == "OBJECT" and (is_mesh or cls.may_be_redone(context))

    def draw(self, context):
        setting_rows.row(self.layout, self.properties, "surface")
        for name in ("strand_count", "root_end", "reaches_surface", "uses_alpha", "fills", "seed"):
            setting_rows.row(self.layout, self.properties, name)
        for name in ("guide_count", "hides_mesh"):
            setting_rows.row(self.layout, self.properties, name)

    def seconds(self, context):
        return 1.0  # takes noticeable time for any hair

    def work(self, context):
        layer, selected = context.view_layer, context.selected_objects
        surface = foreign_meshes.find_surface(context.object, layer, selected, self.surface)
        return io.mesh_hair.using_mesh(
            context.object,
            surface,
            context.evaluated_depsgraph_get(),
            setting_properties.given_settings(self, MeshStrandSettings),
            setting_properties.given_settings(self, DerivationSettings),
            hides_mesh=self.hides_mesh,
        )

    def message(self, made):
        counts = {"strand_count": len(made.hair.curves), "piece_count": made.piece_count}
        return "{strand_count} strands of {piece_count} cards, tubes and locks", counts

    def after(self, context, made):
        shown = object_of(made.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))


class VELLUS_OT_transfer_groom(LongOperator, bpy.types.Operator):
    """Copy the active hair system to the other selected mesh, with guides, settings, styles and look"""

    bl_idname = "vellus.transfer_groom"
    bl_label = "Transfer Groom"
    __annotations__ = {
        "target": properties.mesh_name(
            "Target", "Mesh to copy the hair to. Leave empty to use the other selected mesh"
        ),
        **setting_properties.annotations(TransferSettings),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select the mesh to copy hair to, and then the hair, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def draw(self, context):
        setting_rows.row(self.layout, self.properties, "target")
        setting_rows.row(self.layout, self.properties, "method")
        if self.method == "NEAREST":
            setting_rows.row(self.layout, self.properties, "alignment")
        if self.method != "UV":
            setting_rows.row(self.layout, self.properties, "reach")
        setting_rows.row(self.layout, self.properties, "scale_lengths")

    def seconds(self, context):
        hair = hair_of(context.object)
        face_count = scene.triangle_count(self._target(context), context.view_layer)
        return 0.0 if hair is None else cost.hair_seconds(hair.vellus.hair, face_count)

    def work(self, context):
        guides, hair = guides_of(context.object), hair_of(context.object)
        if hair is not None and hair.vellus.guide_curves != guides:
            hair = None
        settings = setting_properties.given_settings(self, TransferSettings)
        return system_transfer.transferring(
            guides, hair, self._target(context), settings, context.evaluated_depsgraph_get()
        )

    def message(self, made):
        if made.hair is None:
            return "{count} guides", {"count": len(made.guides.curves)}
        counts = {"guide_count": len(made.guides.curves), "strand_count": len(made.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts

    def after(self, context, made):
        shown = object_of(made.hair or made.guides, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in made.notes():
            self.report({"WARNING"}, report_text(sentence, **values))

    def _target(self, context):
        if self.target:
            found = context.view_layer.objects.get(self.target)
            if found is None or found.type != "MESH":
                raise HairError('There is no mesh object "{name}".', name=self.target)
            return found
        surface = guides_of(context.object).surface
        others = [o for o in context.selected_objects if o.type == "MESH" and o != surface]
        if len(others) != 1:
            raise HairError("Select the one mesh to copy the hair to, and then the hair.")
        return others[0]


CLASSES = (
    VELLUS_OT_use_as_guides,
    VELLUS_OT_use_as_hair,
    VELLUS_OT_import_groom,
    VELLUS_OT_convert_particles,
    VELLUS_OT_mesh_to_hair,
    VELLUS_OT_transfer_groom,
)
