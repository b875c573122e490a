# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's DistributeGuidePoints: mesh → guides."""

import bpy

from ...core.errors import HairError
from ...core.groom import GuideSettings
from .. import pipeline, properties
from ..selection import guides_again, surface_of


class VELLUS_OT_distribute_guides(bpy.types.Operator):
    """Place guide hairs evenly on the active mesh, or place the active guides again"""

    bl_idname = "vellus.distribute_guides"
    bl_label = "Distribute Guides"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = properties.annotations(GuideSettings)

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh to grow guides on, or guides to place again.")
        return surface_of(context.object) is not None

    def invoke(self, context, _event):
        guides = guides_again(context.object)
        if guides is not None:
            properties.copy(guides.vellus.guides, self, GuideSettings)
        return self.execute(context)

    def execute(self, context):
        try:
            settings = properties.to_settings(self, GuideSettings)
            target = guides_again(context.object)
            depsgraph = context.evaluated_depsgraph_get()
            guides = pipeline.distribute_guides(surface_of(context.object), settings, depsgraph, target)
        except HairError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(guides.curves)} guides")
        return {"FINISHED"}
