# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of long operators that write where the artist says: a file browser first, then the work."""

import bpy

from ...core.errors import HairError
from .modal import LongOperator


class BrowsedOperator(LongOperator):
    """Mixed into an operator whose property `asked` the file browser fills, unless it is given."""

    asked = ""
    _is_browsing = False

    def invoke(self, context, event):
        """Ask where to write, or begin."""
        if self.properties.is_property_set(self.asked):
            return super().invoke(context, event)
        try:
            self.prefill(context)
        except HairError as error:
            return self.refuse(error)
        self._is_browsing = True
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Compute at once; after the file browser as its answer tells, which Blender cannot wait for itself."""
        if not self._is_browsing:
            try:
                self.prefill(context)
            except HairError as error:
                return self.refuse(error)
            return super().execute(context)
        category, name = self.bl_idname.split("_OT_")
        run = getattr(getattr(bpy.ops, category.lower()), name)
        return run("INVOKE_DEFAULT", **self.as_keywords()) & {"CANCELLED"} or {"FINISHED"}
