# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of a particle system → hair or guides of Vellus, in one step."""

import bpy

from .....core.grooming.derived_guides import DerivationSettings
from .....core.grooming.groom import HairSettings
from .....core.long_work import run_now
from ....data import scene
from ....groom.foreign import hand_made_guides, kept_hair, particle_hair
from ....groom.selection import make_active, object_of
from ....settings import properties, setting_properties
from ....settings.translations import report_text
from ... import setting_rows
from ..base.hair_operator import HairOperator


class VELLUS_OT_convert_particles(HairOperator, bpy.types.Operator):
    """Convert the hair of the active mesh's particle system to hair or guides, and switch the system off"""

    bl_idname = "vellus.convert_particles"
    bl_label = "Convert Particle Hair"
    __annotations__ = {
        "use": properties.choice(
            "Convert To",
            "What the hairs become",
            {"HAIR": "Hair", "GUIDES": "Guides"},
            {
                "HAIR": "Keep the hairs as strands, and derive guides from them",
                "GUIDES": "Use the hairs as guides, and grow strands between them",
            },
        ),
        **setting_properties.annotations(DerivationSettings),
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with particle hair, in Object Mode.")
        if context.mode != "OBJECT":
            return False
        return bool(particle_hair.systems_of(context.object)) or cls.may_be_redone(context)

    def draw(self, context):
        setting_rows.row(self.layout, self.properties, "use")
        if self.use == "HAIR":
            setting_rows.row(self.layout, self.properties, "guide_count")

    def change(self, context):
        surface = context.object
        with particle_hair.as_curves(surface) as made:
            depsgraph = scene.present_depsgraph()
            if self.use == "HAIR":
                settings = setting_properties.given_settings(self, DerivationSettings)
                used = run_now(kept_hair.using_as_hair(made, surface, depsgraph, settings))
            else:
                used = hand_made_guides.use_as_guides(made, surface, depsgraph, hair_settings=HairSettings())
        context.view_layer.update()  # which new objects are not in yet
        shown = object_of(used.hair, context.view_layer)
        if shown is not None:
            make_active(shown, context.view_layer)
        for sentence, values in used.notes():
            self.report({"WARNING"}, report_text(sentence, **values))
        counts = {"guide_count": len(used.guides.curves), "strand_count": len(used.hair.curves)}
        return "{guide_count} guides, {strand_count} strands", counts
