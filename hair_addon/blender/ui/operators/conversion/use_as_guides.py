# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves not created by Vellus → guides, and strands between them."""

import bpy

from .....core.errors import HairError
from .....core.grooming import cost
from .....core.grooming.groom import HairSettings
from ....data import scene
from ....groom.foreign import hand_made_guides, joined_curves
from ....groom.foreign.foreign_curves import chosen, is_foreign, require_foreign
from ....groom.selection import make_active, object_of
from ....settings import properties, setting_properties
from ....settings.translations import report_text
from ... import setting_rows
from ..base.modal import LongOperator


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
        setting_rows.search_row(self.layout, self.properties, "surface", bpy.data, "objects")
        for name in ("every", "applies_modifiers", "grows_hair"):
            setting_rows.row(self.layout, self.properties, name)
        if self.grows_hair:
            setting_rows.all_strand_rows(setting_rows.titled(self.layout, "Strands"), self.properties, surface)

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
