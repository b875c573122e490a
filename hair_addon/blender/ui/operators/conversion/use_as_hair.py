# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves not created by Vellus → hair, kept as it is, and guides derived from it."""

import bpy

from .....core.grooming.derived_guides import DerivationSettings
from ....groom.foreign import hand_made_guides, joined_curves, kept_hair
from ....groom.foreign.foreign_curves import chosen, is_foreign, require_foreign
from ....groom.selection import make_active, object_of
from ....settings import properties, setting_properties
from ....settings.translations import report_text
from ... import setting_rows
from ..base.modal import LongOperator


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
        setting_rows.search_row(self.layout, self.properties, "surface", bpy.data, "objects")
        for name in ("guide_count", "applies_modifiers", "follows_guides"):
            setting_rows.row(self.layout, self.properties, name)

    def seconds(self, context):
        return 1.0  # more than a moment for any hair

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
