# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress bar of long work, at the top of the tab while work is running."""

import bpy

from ...host import running
from ...settings.translations import interface_text
from .tab import HairTab


class VELLUS_PT_progress(HairTab, bpy.types.Panel):
    """The running operation"""

    # With a header: Blender places panels without one before all others, which would move the tab above all other tabs.
    bl_label = "Progress"
    bl_idname = "VELLUS_PT_progress"

    @classmethod
    def poll(cls, _context):
        return running.job() is not None

    def draw(self, _context):
        job = running.job()
        step = interface_text("Canceling" if job.is_stopping else job.step)
        self.layout.progress(text=step, factor=job.part, type="BAR")
        self.layout.label(text="Press Esc to cancel")


CLASSES = (VELLUS_PT_progress,)
