# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Render Region of viewports, outside of which Material Preview and Rendered shading show nothing."""

import numpy as np


def read(viewport, region, view, scene):
    """Return (left, bottom, right, top) [pixels] of the Render Region of a viewport, or None.

    In camera view it is that of the scene's renders, relative to the frame of the camera.
    """
    if view.view_perspective != "CAMERA":
        if not viewport.use_render_border:
            return None
        low = viewport.render_border_min_x, viewport.render_border_min_y
        high = viewport.render_border_max_x, viewport.render_border_max_y
        return tuple(
            float(size * part) for part, size in zip((*low, *high), 2 * (region.width, region.height), strict=True)
        )
    render = scene.render
    camera = viewport.camera if viewport.use_local_camera else scene.camera
    if not render.use_border or camera is None or camera.type != "CAMERA":
        return None
    corners = np.array([(*corner, 1.0) for corner in camera.data.view_frame(scene=scene)])
    to_clip = np.array(view.window_matrix) @ np.array(view.view_matrix) @ np.array(camera.matrix_world.normalized())
    clip = corners @ to_clip.T
    places = (0.5 + 0.5 * clip[:, :2] / clip[:, 3:]) * (region.width, region.height)
    first, whole = places.min(axis=0), np.ptp(places, axis=0)
    low = first + whole * (render.border_min_x, render.border_min_y)
    high = first + whole * (render.border_max_x, render.border_max_y)
    return tuple(map(float, (*low, *high)))
