# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh → guides and the strands between them, in one step."""

import bpy

from .....core.grooming import cost
from .....core.grooming.groom import GuideSettings, HairSettings
from ....data import scene
from ....groom import mask_suggestions, pipeline
from ....groom.hair_systems import name_guides
from ....groom.selection import make_active, object_of, surface_of
from ....settings import fitted_sizes, setting_properties
from ... import setting_rows
from ..base.modal import LongOperator

_OWN = tuple(
    name for name in setting_properties.names_of(HairSettings) if name in setting_properties.names_of(GuideSettings)
)


class VELLUS_OT_add_hair(LongOperator, bpy.types.Operator):
    """Create a hair system on the active mesh: guides to comb and strands that follow them"""

    bl_idname = "vellus.add_hair"
    bl_label = "New Hair System"
    __annotations__ = setting_properties.annotations(GuideSettings) | setting_properties.annotations(
        HairSettings, skip=_OWN
    )

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh to grow hair on.")
        return surface_of(context.object) is not None

    def draw(self, context):
        surface = surface_of(context.object)
        setting_rows.all_guide_rows(self.layout, self.properties, surface)
        strands = setting_rows.titled(self.layout, "Strands")
        setting_rows.all_strand_rows(strands, self.properties, surface, skip=_OWN)

    def prefill(self, context):
        if not self.properties.is_property_set("density_group"):
            self.density_group = mask_suggestions.filled(surface_of(context.object))

    def seconds(self, context):
        guide_settings, hair_settings = self._settings()
        face_count = scene.triangle_count(surface_of(context.object), context.view_layer)
        return cost.guide_seconds(guide_settings, face_count) + cost.hair_seconds(hair_settings, face_count)

    def work(self, context):
        may_drape = fitted_sizes.is_open(self, "drape")
        surface, depsgraph = surface_of(context.object), context.evaluated_depsgraph_get()
        return pipeline.adding_hair(surface, *self._settings(), depsgraph, may_drape=may_drape)

    def message(self, made):
        guides, hair = made
        return "{guide_count} guides, {strand_count} strands", {
            "guide_count": len(guides.curves),
            "strand_count": len(hair.curves),
        }

    def after(self, context, made):
        guides, hair = made
        setting_properties.show(self, guides.vellus.guides, GuideSettings)
        setting_properties.show(self, hair.vellus.hair, HairSettings)
        context.view_layer.update()  # to evaluate the new objects
        hair_object = object_of(hair, context.view_layer)
        name_guides(hair_object)
        make_active(hair_object, context.view_layer)

    def _settings(self):
        """The seed is asked for once; strands take the mask of their guides."""
        hair_settings = setting_properties.given_settings(self, HairSettings, skip=("density_group", "density_image"))
        return setting_properties.given_settings(self, GuideSettings), hair_settings
