# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: guide tools."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import HairError
from ..core.grooming import guide_tool_settings
from ..core.grooming.guide_tool_settings import CopySettings, FlowSettings, ToolSettings
from ..core.grooming.ties import gather_settings
from ..core.params import array_of, require_class
from .arguments import changed, choice
from .blender_access import blender

Curves = Any

__all__ = ["change_guides", "paint_flow"]

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


def paint_flow(guides: Curves, stroke: ArrayLike, settings: FlowSettings | None = None, **changes: Any) -> int:
    """Turn guides near a stroke on their surface toward the direction of the stroke, as the Paint Flow tool does.

    stroke: points (K, 3) on the posed surface, in its local coordinates; settings and changes: as for `change_guides`.
    Returns the number of turned guides. Raises `HairError`.

    >>> guides = bpy.data.objects["Guides"]
    >>> turned = api.paint_flow(guides, [(0.0, 0.0, 0.1), (0.05, 0.0, 0.1)], radius=0.03)
    """
    wanted = changed(FlowSettings, settings, changes)
    places = array_of(stroke, np.float64)
    if places is None or places.ndim != 2 or places.shape[1] != 3:
        raise HairError("A stroke must be an array of points (K, 3).")
    target, depsgraph = blender.data.arguments.guides_of(guides), blender.data.scene.present_depsgraph()
    return blender.groom.guides.flow_painting.paint(target, places, wanted, depsgraph)
