# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's HairInterpolation: guides → strands."""

import bpy

from .....core.grooming import cost
from .....core.grooming.groom import HairSettings
from ....data import scene
from ....data.strands.curves import require_editable
from ....groom import pipeline
from ....groom.selection import active_of_kind, guides_of, surface_of
from ....settings import setting_properties
from ... import setting_rows
from ..base.modal import LongOperator


class VELLUS_OT_interpolate_hair(LongOperator, bpy.types.Operator):
    """Generate strands from the guides of the active object, or regenerate the active hair"""

    bl_idname = "vellus.interpolate_hair"
    bl_label = "Generate Strands"
    __annotations__ = setting_properties.annotations(HairSettings)

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides, the mesh they grow on, or hair to regenerate.")
        return guides_of(context.object) is not None

    def draw(self, context):
        setting_rows.all_strand_rows(self.layout, self.properties, surface_of(context.object))

    def prefill(self, context):
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            setting_properties.prefill(self, hair.vellus.hair, HairSettings)

    def seconds(self, context):
        surface = guides_of(context.object).surface
        face_count = 0 if surface is None else scene.triangle_count(surface, context.view_layer)
        return cost.hair_seconds(setting_properties.given_settings(self, HairSettings), face_count)

    def work(self, context):
        settings = setting_properties.given_settings(self, HairSettings)
        depsgraph = context.evaluated_depsgraph_get()
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            require_editable(hair)
        return pipeline.interpolating_hair(guides_of(context.object), settings, depsgraph, hair)

    def after(self, context, made):
        setting_properties.show(self, made.vellus.hair, HairSettings)

    def message(self, made):
        return "{count} strands", {"count": len(made.curves)}
