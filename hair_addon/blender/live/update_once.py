# SPDX-License-Identifier: GPL-3.0-or-later
"""Updates guides and hair without Auto Update on demand."""

from ..data.strands import curves
from . import live_hair


def update_once(parts, view_layer):
    """Update Curves as if Auto Update were on for a moment; parts with Auto Update stay as they are."""
    waiting = [part for part in parts if not part.vellus.is_live]
    try:
        for part in waiting:
            part.vellus.is_live = True
            part.vellus.is_stale = part.vellus.is_stale and not curves.is_combed(part)
            part.update_tag()
            if part.surface is not None and part.surface.data is not None:
                part.surface.data.update_tag()  # the mesh may have been edited meanwhile
        view_layer.update()
        live_hair.write_all()
    finally:
        for part in waiting:
            part.vellus.is_live = False
