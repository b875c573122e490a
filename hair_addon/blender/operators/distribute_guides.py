# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's DistributeGuidePoints: mesh → guides."""

import bpy

from ...core import estimate
from ...core.groom import GuideSettings
from .. import pipeline, properties, scene
from ..selection import guides_again, surface_of
from .modal import LongOperator


class VELLUS_OT_distribute_guides(LongOperator, bpy.types.Operator):
    """Place guide hairs evenly on the active mesh, or place the active guides again"""

    bl_idname = "vellus.distribute_guides"
    bl_label = "Distribute Guides"
    __annotations__ = properties.annotations(GuideSettings)

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh to grow guides on, or guides to place again.")
        return surface_of(context.object) is not None

    def prefill(self, context):
        guides = guides_again(context.object)
        if guides is not None:
            properties.copy(guides.vellus.guides, self, GuideSettings)

    def seconds(self, context):
        face_count = scene.triangle_count(surface_of(context.object), context.view_layer)
        return estimate.guide_seconds(properties.to_settings(self, GuideSettings), face_count)

    def work(self, context):
        settings = properties.to_settings(self, GuideSettings)
        depsgraph = context.evaluated_depsgraph_get()
        return pipeline.distributing_guides(
            surface_of(context.object), settings, depsgraph, guides_again(context.object)
        )

    def message(self, made):
        return "{count} guides", {"count": len(made.curves)}
