# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's HairInterpolation: guides → strands."""

import bpy

from ...core import estimate
from ...core.groom import HairSettings
from .. import pipeline, properties, scene
from ..selection import active_of_kind, guides_of
from .modal import LongOperator


class VELLUS_OT_interpolate_hair(LongOperator, bpy.types.Operator):
    """Grow strands between the guides of the active object, or grow the active hair again"""

    bl_idname = "vellus.interpolate_hair"
    bl_label = "Interpolate Hair"
    __annotations__ = properties.annotations(HairSettings)

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select guides, the mesh that they grow on, or hair to grow again.")
        return guides_of(context.object) is not None

    def prefill(self, context):
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            properties.copy(hair.vellus.hair, self, HairSettings)

    def seconds(self, context):
        surface = guides_of(context.object).surface
        face_count = 0 if surface is None else scene.triangle_count(surface, context.view_layer)
        return estimate.hair_seconds(properties.to_settings(self, HairSettings), face_count)

    def work(self, context):
        settings = properties.to_settings(self, HairSettings)
        depsgraph = context.evaluated_depsgraph_get()
        return pipeline.interpolating_hair(
            guides_of(context.object), settings, depsgraph, active_of_kind(context.object, "HAIR")
        )

    def message(self, made):
        return "{count} strands", {"count": len(made.curves)}
