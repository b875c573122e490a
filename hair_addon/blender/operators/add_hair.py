# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh → guides and the strands between them, in one step."""

import bpy

from ...core import estimate
from ...core.groom import GuideSettings, HairSettings
from .. import pipeline, properties, scene
from ..selection import make_active, object_of, surface_of
from .modal import LongOperator

_OWN = tuple(name for name in properties.names_of(HairSettings) if name in properties.names_of(GuideSettings))


class VELLUS_OT_add_hair(LongOperator, bpy.types.Operator):
    """Grow hair on the active mesh: guides to comb, and the strands between them"""

    bl_idname = "vellus.add_hair"
    bl_label = "Add Hair"
    __annotations__ = properties.annotations(GuideSettings) | properties.annotations(HairSettings, skip=_OWN)

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh to grow hair on.")
        return context.object is not None and context.object.type == "MESH"

    def seconds(self, context):
        guide_settings, hair_settings = self._settings()
        face_count = scene.triangle_count(context.object, context.view_layer)
        return estimate.guide_seconds(guide_settings, face_count) + estimate.hair_seconds(hair_settings, face_count)

    def work(self, context):
        return pipeline.adding_hair(surface_of(context.object), *self._settings(), context.evaluated_depsgraph_get())

    def message(self, made):
        guides, hair = made
        return "{guide_count} guides, {strand_count} strands", {
            "guide_count": len(guides.curves),
            "strand_count": len(hair.curves),
        }

    def after(self, context, made):
        _guides, hair = made
        context.view_layer.update()  # or it does not know the new objects yet
        make_active(object_of(hair, context.view_layer), context.view_layer)

    def _settings(self):
        """What guides and strands have in common, seed and density, is asked for once."""
        return properties.to_settings(self, GuideSettings), properties.to_settings(self, HairSettings)
