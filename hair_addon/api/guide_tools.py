# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: guide tools."""

from typing import Any

from ..core.grooming import guide_tool_settings
from ..core.grooming.guide_tool_settings import CopySettings, ToolSettings
from ..core.grooming.ties import gather_settings
from ..core.params import require_class
from .arguments import changed, choice
from .blender_access import blender

Curves = Any

__all__ = ["change_guides"]

# Tool → its settings.
TOOLS = {
    "LENGTH": guide_tool_settings.LengthSettings,
    "TRIM": guide_tool_settings.TrimSettings,
    "COUNT": guide_tool_settings.CountSettings,
    "MIRROR": guide_tool_settings.MirrorSettings,
    "COPY": guide_tool_settings.CopySettings,
    "SMOOTH": guide_tool_settings.SmoothSettings,
    "LIFT": guide_tool_settings.LiftSettings,
    "ATTRACT": guide_tool_settings.AttractSettings,
    "DRAPE": guide_tool_settings.DrapeSettings,
    "OUTSIDE": guide_tool_settings.OutsideSettings,
    "GATHER": gather_settings.GatherSettings,
}


def change_guides(
    guides: Curves, tool: str, settings: ToolSettings | CopySettings | None = None, **changes: Any
) -> int:
    """Apply a guide tool to guide Curves, which stay combed; returns the number of changed guides.

    For "MIRROR" the number of mirrored guides is returned, for "COUNT" the new number of guides.

    tool: "LENGTH", "TRIM", "COUNT", "MIRROR", "COPY", "SMOOTH", "LIFT", "ATTRACT", "DRAPE", "OUTSIDE" or "GATHER";
    settings: of the tool, from core/grooming/guide_tool_settings.py or ties/gather_settings.py; changes: its fields by
    name. Hair follows at the next update of the view layer.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.change_guides(guides, "LENGTH", method="MAXIMUM", length=0.2)
    50
    >>> api.change_guides(guides, "COUNT", factor=1.5)
    75
    """
    settings_class = TOOLS[choice(tool, "guide tool", TOOLS)]
    if settings is not None:
        require_class(settings, settings_class, "settings")
    wanted = changed(settings_class, settings, changes)
    target, depsgraph = blender.data.arguments.guides_of(guides), blender.data.scene.present_depsgraph()
    tools, additions = blender.groom.guides.guide_tools, blender.groom.guides.guide_additions
    functions = {
        "LENGTH": tools.change_lengths,
        "TRIM": tools.trim,
        "COUNT": additions.change_count,
        "MIRROR": additions.mirror,
        "COPY": tools.copy_shape,
        "SMOOTH": tools.smooth,
        "LIFT": tools.lift,
        "ATTRACT": tools.attract,
        "DRAPE": blender.groom.dynamics.guide_draping.drape,
        "OUTSIDE": blender.groom.guides.outside_guides.push,
        "GATHER": blender.groom.guides.gathered_guides.gather,
    }
    return functions[tool](target, wanted, depsgraph)
