# SPDX-License-Identifier: GPL-3.0-or-later
"""A cached marker for strands that cannot be drawn, so that redraws do not try again before they change."""

import sys
from dataclasses import dataclass

import bpy

from ...core.errors import HairError
from ..host import running


@dataclass(frozen=True)
class Refused:
    """Strands that are not drawn, and the reason."""

    error: HairError


def refused(error: HairError) -> Refused:
    """Print why strands are not drawn, and return the marker."""
    print(f"Vellus: {error}", file=sys.stderr)
    if running.has_window() and not bpy.app.timers.is_registered(show_in_panels):
        bpy.app.timers.register(show_in_panels)
    return Refused(error)


def show_in_panels() -> None:
    """Redraw the sidebars, for `bpy.app.timers`: they were drawn before the strands that their panels report."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == "UI":
                    region.tag_redraw()


def error_of(cached: object) -> HairError | None:
    """Return the error of a value in `hair_cache.strand_cache`, or None."""
    return cached.error if isinstance(cached, Refused) else None
