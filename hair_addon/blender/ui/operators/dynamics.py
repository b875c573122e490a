# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of simulated guides: play, bake, deliver, free."""

import bpy

from ....core.dynamics.rod.presets import PRESETS, applied
from ....core.dynamics.rod.settings import DynamicsSettings
from ....core.errors import HairError
from ....core.files import frame_cache
from ....core.grooming import cost
from ....core.params import declared
from ... import io
from ...data.strands import curves, delivered_hair
from ...groom.dynamics import dynamics_notes, frame_folders, guide_baking, guide_simulation
from ...groom.selection import guides_of
from ...groom.transfer import groom_settings
from ...host import memory, scene_time
from ...live import simulated_hair
from ...settings import properties
from ...settings.translations import report_text
from .base.hair_operator import HairOperator, needs_guides
from .base.modal import LongOperator


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
        is_changed = simulated_hair.begin(context.scene)
        bpy.ops.screen.animation_play()
        if is_changed:
            return "Every frame is played until playback stops: the simulation needs every frame", {}
        return None


class VELLUS_OT_bake_dynamics(LongOperator, bpy.types.Operator):
    """Simulate the active guides up to the last frame of the scene and write the frames to files, which renders read"""

    bl_idname = "vellus.bake_dynamics"
    bl_label = "Bake Dynamics"
    __annotations__ = {
        "starts_over": properties.switch(
            "Start Over", "Simulate all frames again; when off, baking continues after the existing frames", False
        )
    }
    applies = needs_guides

    def seconds(self, context):
        guides, frames = guides_of(context.object), scene_time.scene_frames()
        settings = properties.dynamics_of(guides.vellus)
        return cost.simulation_seconds(settings.vertex_count, len(guides.curves), settings.substeps, len(frames))

    def work(self, context):
        guides = guides_of(context.object)
        if not bpy.data.filepath and guides.vellus.cache_folder.startswith("//"):
            raise HairError("Baked frames are kept beside the .blend file: save the file first.")
        self._say_memory(guide_baking.memory_of([guides]))
        guides.vellus.simulates = True
        last = scene_time.scene_frames()[-1]
        (baked,) = yield from guide_baking.baking([guides], last, context.scene, self.starts_over)
        return baked

    def _say_memory(self, byte_count):
        """Warn about baking that needs much of the free memory; Esc stops it."""
        part = memory.share_of_free(byte_count)
        if memory.MUCH < part <= memory.MOST:
            message = "Baking takes {percent}% of the free memory"
            self.report({"WARNING"}, report_text(message, percent=round(100.0 * part)))

    def message(self, made):
        if made.broken:
            return (
                "Frames {first} to {last} baked; strands broke {count} times and were reset to their combed shape",
                {"first": made.first, "last": made.last, "count": made.broken},
            )
        return "Frames {first} to {last} baked", {"first": made.first, "last": made.last}

    def stopped(self):
        """Return the report after Esc."""
        return report_text("Stopped: the frames so far are kept, and Bake Dynamics continues after them.")


class VELLUS_OT_free_dynamics(HairOperator, bpy.types.Operator):
    """Remove the baked frames of the active guides from the disk; this cannot be undone"""

    bl_idname = "vellus.free_dynamics"
    bl_label = "Free Baked Frames"
    bl_options = {"REGISTER"}

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides whose frames have been baked.")
        guides = guides_of(context.object)
        # Read here and cached: nothing else has read the folder if the add-on was enabled while the file is open.
        baked = None if guides is None else frame_folders.frames_of(guides)
        return baked is not None and baked.manifest is not None

    def invoke(self, context, event):
        """Ask for confirmation."""
        return context.window_manager.invoke_confirm(self, event)

    def change(self, context):
        guides = guides_of(context.object)
        count = frame_cache.remove(frame_folders.folder_of(guides))
        frame_folders.have_changed(guides)
        return "{count} files removed", {"count": count}


class VELLUS_OT_deliver_dynamics(LongOperator, bpy.types.Operator):
    """Write the baked hair to a file beside the .blend, and let Blender play it: linked files, render farms and \
Blender without Vellus show the same hair"""

    bl_idname = "vellus.deliver_dynamics"
    bl_label = "Deliver Hair"
    applies = needs_guides

    def seconds(self, context):
        return float("inf")  # the duration of the animation itself is unknown

    def work(self, context):
        guides = guides_of(context.object)
        return (yield from io.delivery.delivering(guides, io.delivery.path_of(guides), context.scene))

    def message(self, made):
        values = {"first": made.first, "last": made.last, "file": made.path.name}
        return "Frames {first} to {last} delivered in {file}", values

    def stopped(self):
        """Return the report after Esc."""
        return report_text("Canceled: hair was not delivered.")


class VELLUS_OT_remove_delivery(HairOperator, bpy.types.Operator):
    """Let the hair follow its guides again instead of playing the delivered frames. The file is kept"""

    bl_idname = "vellus.remove_delivery"
    bl_label = "Remove Delivered Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides whose hair has been delivered.")
        guides = guides_of(context.object)
        return guides is not None and any(map(delivered_hair.is_delivered, curves.followers(guides)))

    def change(self, context):
        io.delivery.take_off(guides_of(context.object))


class VELLUS_OT_apply_dynamics_preset(HairOperator, bpy.types.Operator):
    """Make the simulated guides move like another kind of hair"""

    bl_idname = "vellus.apply_dynamics_preset"
    bl_label = "Apply Dynamics Preset"
    __annotations__ = {
        "preset": properties.choice(
            "Preset",
            "Preset to apply",
            {identifier: label for identifier, (label, _tooltip, _changes) in PRESETS.items()},
            {identifier: tooltip for identifier, (_label, tooltip, _changes) in PRESETS.items()},
        )
    }
    applies = needs_guides

    def change(self, context):
        guides = guides_of(context.object)
        wanted = applied(properties.own_dynamics_of(guides.vellus), self.preset)
        groom_settings.assign_dynamics(guides, wanted)
        return PRESETS[self.preset][0], {}


_MOST = next(details.high for name, _default, details in declared(DynamicsSettings) if name == "bend_stiffness")


class VELLUS_OT_stiffen_dynamics(HairOperator, bpy.types.Operator):
    """Raise the bend stiffness to the lowest value at which all guides hold their shape under their weight"""

    bl_idname = "vellus.stiffen_dynamics"
    bl_label = "Stiffen"
    applies = needs_guides

    def change(self, context):
        guides = guides_of(context.object)
        curves.require_overridable(guides)
        needed = guide_simulation.needed_stiffness(guides, context.scene, context.evaluated_depsgraph_get())
        settings = guides.vellus.dynamics
        if needed.max() <= settings.bend_stiffness:
            return "All guides hold their shape with a bend stiffness of {stiffness}", {
                "stiffness": f"{settings.bend_stiffness:g}"
            }
        stiffness = dynamics_notes.rounded_up(float(needed.max()))
        if stiffness > _MOST:
            raise HairError(
                "Guides need a bend stiffness of {stiffness}, above the maximum: shorten them, or use Hold.",
                stiffness=f"{stiffness:g}",
            )
        settings.bend_stiffness = stiffness
        return "Bend stiffness {stiffness}: all guides can hold their shape", {"stiffness": f"{stiffness:g}"}


CLASSES = (
    VELLUS_OT_play_dynamics,
    VELLUS_OT_bake_dynamics,
    VELLUS_OT_free_dynamics,
    VELLUS_OT_deliver_dynamics,
    VELLUS_OT_remove_delivery,
    VELLUS_OT_apply_dynamics_preset,
    VELLUS_OT_stiffen_dynamics,
)
