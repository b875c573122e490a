# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's HairInterpolation: guides → strands."""

import bpy

from ...core.errors import HairError
from ...core.groom import HairSettings
from .. import pipeline, properties
from ..selection import active_of_kind, guides_of


class VELLUS_OT_interpolate_hair(bpy.types.Operator):
    """Grow strands between the guides of the active object, or grow the active hair again"""

    bl_idname = "vellus.interpolate_hair"
    bl_label = "Interpolate Hair"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = properties.annotations(HairSettings)

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select guides, the mesh that they grow on, or hair to grow again.")
        return guides_of(context.object) is not None

    def invoke(self, context, _event):
        hair = active_of_kind(context.object, "HAIR")
        if hair is not None:
            properties.copy(hair.vellus.hair, self, HairSettings)
        return self.execute(context)

    def execute(self, context):
        try:
            settings = properties.to_settings(self, HairSettings)
            target = active_of_kind(context.object, "HAIR")
            depsgraph = context.evaluated_depsgraph_get()
            hair = pipeline.interpolate_hair(guides_of(context.object), settings, depsgraph, target)
        except HairError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(hair.curves)} strands")
        return {"FINISHED"}
