# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of long operators that show their settings and an estimate of the result before they start."""

from ....host import running
from .modal import LongOperator

_WIDTH = 360  # width of the dialog [pixels]


class DialogOperator(LongOperator):
    """Mixin of operators that open a dialog unless they are given a setting."""

    _is_asking = False

    def invoke(self, context, event):
        """Open the dialog, or start."""
        names = set(self.properties.bl_rna.properties.keys()) - {"rna_type"}  # always counts as set
        is_given = any(map(self.properties.is_property_set, names))
        if is_given or not running.has_window():
            return super().invoke(context, event)
        self._is_asking = True
        return context.window_manager.invoke_props_dialog(self, width=_WIDTH)

    def execute(self, context):
        """Compute immediately, or start after the dialog: Blender does not wait for dialogs."""
        if not self._is_asking:
            return super().execute(context)
        self._is_asking = False
        # Work that continues pushes its own undo step when done.
        return self.begin_anew() & {"FINISHED"} or {"CANCELLED"}
