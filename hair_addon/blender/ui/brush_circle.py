# SPDX-License-Identifier: GPL-3.0-or-later
"""Circle of the Paint Flow brush on the surface below the mouse."""

import numpy as np
from bpy_extras import view3d_utils

from ..gpu import window_lines
from ..groom.guides import flow_painting
from ..groom.selection import guides_of

_COLOR = (1.0, 1.0, 1.0, 0.8)
_WIDTH = 1.5  # [pixels]


# Place of the circle in the window [pixels] while mouse movement changes the brush; None: at the mouse.
_held = None


def hold(place):
    """Keep the circle at a place (2,) in the window [pixels]; None lets it follow the mouse again."""
    global _held
    _held = place


def draw(context, brush, xy):
    """Draw the brush's circle at the mouse xy in the window [pixels]; brush: the properties of `vellus.paint_flow`."""
    xy = _held or xy
    region, view, guides = context.region, context.region_data, guides_of(context.object)
    if region is None or view is None or guides is None or guides.surface is None:
        return
    places = in_window(circle(context, guides, brush, (xy[0] - region.x, xy[1] - region.y)), region, view)
    if places is None:
        return
    window_lines.draw_loop(places, _COLOR, _WIDTH)


def circle(context, guides, brush, mouse):
    """Return points (N, 3) of a brush's circle in world coordinates, for the mouse in the region [pixels], or None."""
    origin = view3d_utils.region_2d_to_origin_3d(context.region, context.region_data, mouse)
    direction = view3d_utils.region_2d_to_vector_3d(context.region, context.region_data, mouse)
    # Drawing does not update the evaluated scene.
    return flow_painting.brush_circle(guides.surface, origin, direction, brush.radius, context.view_layer.depsgraph)


def in_window(points, region, view):
    """Return places (N, 2) of points (N, 3) in the window [pixels]; None without points or with one behind the view."""
    if points is None:
        return None
    projected = np.pad(points, ((0, 0), (0, 1)), constant_values=1.0) @ np.array(view.perspective_matrix).T
    depth = projected[:, 3:]
    if not (depth > 0.0).all():
        return None
    size = np.array([region.width, region.height])
    return (0.5 + 0.5 * projected[:, :2] / depth) * size + (region.x, region.y)
