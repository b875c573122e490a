# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of the guide tools: they change the guides of the active hair in place, in Object, Sculpt and Edit Mode."""

from .....core.grooming.guide_tool_settings import ToolSettings
from .....core.params import declared
from ....groom.selection import guides_of, surface_of
from ....settings import setting_properties
from ... import setting_rows
from ..base.hair_operator import HairOperator

_MODES = {"OBJECT", "SCULPT_CURVES", "EDIT_CURVES"}
_COMMON = setting_properties.names_of(ToolSettings)


class GuideTool(HairOperator):
    """Mixin of tools that name their `Settings` and implement `apply`."""

    Settings = ToolSettings

    @classmethod
    def applies(cls, context):
        """Whether there are guides to change."""
        cls.poll_message_set("Select guides, the mesh they grow on, or hair that follows them.")
        return context.mode in _MODES and guides_of(context.object) is not None

    def apply(self, guides, settings, depsgraph):
        """Change guide Curves; returns the number of guides for the message."""
        raise NotImplementedError

    def prefill(self, guides):
        """Set values that follow from the guides, when the tool is called with a mouse or a key."""

    def invoke(self, context, _event):
        """Set values that follow from the guides, and change these."""
        self.prefill(guides_of(context.object))
        return self.execute(context)

    def change(self, context):
        """Change the guides, and say how many."""
        settings = setting_properties.to_settings(self, self.Settings)
        return self.message(self.apply(guides_of(context.object), settings, context.evaluated_depsgraph_get()))

    def message(self, count):
        """(sentence, values) of the report."""
        return "{count} guides changed", {"count": count}

    def draw(self, context):
        """The tool's settings, and those that all tools have."""
        self.draw_settings(self.layout)
        self.draw_choice(self.layout, surface_of(context.object))

    def draw_settings(self, layout):
        """The rows of the tool's own settings."""
        for name, _default, _details in declared(self.Settings):
            if name not in _COMMON:
                setting_rows.row(layout, self.properties, name)

    def draw_choice(self, layout, surface):
        """The rows that say which guides are changed."""
        setting_rows.row(layout, self.properties, "selected_only")
        if surface is not None:
            setting_rows.search_row(layout, self.properties, "mask", surface, "vertex_groups")
