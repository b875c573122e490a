# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove baked frames."""

import bpy

from .....core.files import frame_cache
from ....groom.dynamics import frame_folders
from ....groom.selection import guides_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_free_dynamics(HairOperator, bpy.types.Operator):
    """Remove the baked frames of the active guides from the disk; this cannot be undone"""

    bl_idname = "vellus.free_dynamics"
    bl_label = "Free Baked Frames"
    bl_options = {"REGISTER"}

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides whose frames have been baked.")
        guides = guides_of(context.object)
        # Read once and kept: nothing else has looked where the add-on was enabled while the file is open.
        baked = None if guides is None else frame_folders.frames_of(guides)
        return baked is not None and baked.manifest is not None

    def invoke(self, context, event):
        """Ask first."""
        return context.window_manager.invoke_confirm(self, event)

    def change(self, context):
        guides = guides_of(context.object)
        count = frame_cache.remove(frame_folders.folder_of(guides))
        frame_folders.have_changed(guides)
        return "{count} files removed", {"count": count}
