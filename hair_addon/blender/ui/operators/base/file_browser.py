# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of long operators that write a file: file browser first, then the computation."""

from .....core.errors import HairError
from .modal import LongOperator


class BrowsedOperator(LongOperator):
    """Mixin of operators whose property `asked` is set by the file browser, unless given."""

    asked = ""
    _is_browsing = False

    def invoke(self, context, event):
        """Open the file browser, or start."""
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
        """Compute immediately, or start after the file browser: Blender does not wait for file browsers."""
        if not self._is_browsing:
            try:
                self.prefill(context)
            except HairError as error:
                return self.refuse(error)
            return super().execute(context)
        return self.begin_anew() & {"CANCELLED"} or {"FINISHED"}
