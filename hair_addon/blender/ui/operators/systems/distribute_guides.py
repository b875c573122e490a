# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's DistributeGuidePoints: mesh → guides."""

import bpy

from .....core.grooming import cost
from .....core.grooming.groom import GuideSettings
from ....data import scene
from ....data.strands.curves import require_editable
from ....groom import pipeline
from ....groom.selection import guides_again, surface_of
from ....settings import fitted_sizes, setting_properties
from ... import setting_rows
from ..base.modal import LongOperator


class VELLUS_OT_distribute_guides(LongOperator, bpy.types.Operator):
    """Distribute guides evenly on the active mesh, or regenerate the active guides"""

    bl_idname = "vellus.distribute_guides"
    bl_label = "Generate Guides"
    __annotations__ = setting_properties.annotations(GuideSettings)

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow guides on, or guides to regenerate.")
        return surface_of(context.object) is not None

    def draw(self, context):
        setting_rows.all_guide_rows(self.layout, self.properties, surface_of(context.object))

    def prefill(self, context):
        guides = guides_again(context.object)
        if guides is not None:
            setting_properties.prefill(self, guides.vellus.guides, GuideSettings)

    def seconds(self, context):
        face_count = scene.triangle_count(surface_of(context.object), context.view_layer)
        return cost.guide_seconds(setting_properties.given_settings(self, GuideSettings), face_count)

    def work(self, context):
        settings = setting_properties.given_settings(self, GuideSettings)
        depsgraph = context.evaluated_depsgraph_get()
        surface, target = surface_of(context.object), guides_again(context.object)
        if target is not None:
            require_editable(target)
        may_drape = fitted_sizes.is_open(self, "drape")
        return pipeline.distributing_guides(surface, settings, depsgraph, target, may_drape=may_drape)

    def after(self, context, made):
        setting_properties.show(self, made.vellus.guides, GuideSettings)

    def message(self, made):
        return "{count} guides", {"count": len(made.curves)}
