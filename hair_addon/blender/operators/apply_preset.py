# SPDX-License-Identifier: GPL-3.0-or-later
"""A named look → the active hair's appearance."""

from dataclasses import replace

import bpy

from ...core.errors import HairError
from ...core.shading.presets import PRESETS
from .. import curves, pipeline, properties
from ..selection import active_of_kind


class VELLUS_OT_apply_preset(bpy.types.Operator):
    """Make the active hair look like natural, dyed or wet hair"""

    bl_idname = "vellus.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "preset": properties.choice(
            "Preset", "The look to begin with", {identifier: label for identifier, (label, _look) in PRESETS.items()}
        )
    }

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select hair.")
        return active_of_kind(context.object, "HAIR") is not None

    def execute(self, context):
        hair = active_of_kind(context.object, "HAIR")
        label, look = PRESETS[self.preset]
        group = hair.vellus.appearance
        try:
            curves.require_editable(hair)
        except HairError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        properties.assign(group, replace(look, mode=group.mode))  # how to draw is no part of a look
        pipeline.evaluate_shading(hair)
        self.report({"INFO"}, label)
        return {"FINISHED"}
