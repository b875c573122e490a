# SPDX-License-Identifier: GPL-3.0-or-later
"""Play the animation from the first simulated frame."""

import bpy

from ....groom.selection import guides_of
from ....host import scene_time
from ....live import every_frame
from ....settings import properties
from ..base.hair_operator import HairOperator


class VELLUS_OT_play_dynamics(HairOperator, bpy.types.Operator):
    """Simulate the active guides while the animation plays, from their start frame on"""

    bl_idname = "vellus.play_dynamics"
    bl_label = "Play from Start"
    bl_options = {"REGISTER"}  # a change of frame is not undone

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides, the mesh they grow on, or hair that follows them, in a window.")
        return guides_of(context.object) is not None and context.screen is not None

    def change(self, context):
        guides = guides_of(context.object)
        start = properties.dynamics_of(guides.vellus).start_frame
        guides.vellus.simulates = True
        if context.screen.is_animation_playing:
            bpy.ops.screen.animation_cancel(restore_frame=False)
        scene_time.go_to(context.scene, start)
        is_changed = every_frame.begin(context.scene)
        bpy.ops.screen.animation_play()
        if is_changed:
            return "Every frame is played until playing stops: the simulation needs each of them", {}
        return None
