# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated guides → frames in files."""

import bpy

from .....core.errors import HairError
from .....core.grooming import cost
from ....groom.dynamics import guide_baking
from ....groom.selection import guides_of
from ....host import memory, scene_time
from ....settings import properties
from ....settings.translations import report_text
from ..base.hair_operator import needs_guides
from ..base.modal import LongOperator


class VELLUS_OT_bake_dynamics(LongOperator, bpy.types.Operator):
    """Simulate the active guides up to the last frame of the scene and write the frames to files, which renders read"""

    bl_idname = "vellus.bake_dynamics"
    bl_label = "Bake Dynamics"
    __annotations__ = {
        "starts_over": properties.switch(
            "Start Over", "Simulate all frames again; when off, baking goes on after the frames that are there", False
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
        """Warn of work that takes much of the free memory; Esc stops it."""
        part = memory.share_of_free(byte_count)
        if memory.MUCH < part <= memory.MOST:
            said = "Baking takes {percent}% of the free memory"
            self.report({"WARNING"}, report_text(said, percent=round(100.0 * part)))

    def message(self, made):
        if made.broken:
            return (
                "Frames {first} to {last} baked; strands broke {count} times and were put back as they were combed",
                {"first": made.first, "last": made.last, "count": made.broken},
            )
        return "Frames {first} to {last} baked", {"first": made.first, "last": made.last}

    def stopped(self):
        """What is reported after Esc."""
        return report_text("Stopped: the frames so far are kept, and Bake Dynamics goes on after them.")
