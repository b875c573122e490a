# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of a picture: rays through it, and projection of places to it."""

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": True})

AREA = 4.0  # of a picture, whose coordinates are from -1 to 1


@dataclass(frozen=True, eq=False)
class View:
    """A camera's view, for a whole picture or a part of it."""

    world_to_clip: np.ndarray  # (4, 4), of the part

    def near(self, x: float, y: float) -> np.ndarray:
        """Return the point (3,) of the near plane at x and y, from -1 to 1."""
        found = np.linalg.inv(self.world_to_clip) @ [x, y, -1.0, 1.0]
        return found[:3] / found[3]


@wp.struct
class ViewOnDevice:
    """`View`: rays from near + x near_x + y near_y, and rows of the matrix; row_near: zero on the near plane."""

    near: wp.vec3
    near_x: wp.vec3
    near_y: wp.vec3
    row_x: wp.vec4
    row_y: wp.vec4
    row_w: wp.vec4
    row_near: wp.vec4


def on_device(view: View) -> ViewOnDevice:
    """Return a view's struct."""
    found = ViewOnDevice()
    middle = view.near(0.0, 0.0)
    found.near = wp.vec3(*middle.tolist())
    found.near_x = wp.vec3(*(view.near(1.0, 0.0) - middle).tolist())
    found.near_y = wp.vec3(*(view.near(0.0, 1.0) - middle).tolist())
    x, y, z, w = np.asarray(view.world_to_clip, float)
    found.row_x, found.row_y, found.row_w = wp.vec4(*x.tolist()), wp.vec4(*y.tolist()), wp.vec4(*w.tolist())
    found.row_near = wp.vec4(*(z + w).tolist())
    return found


@wp.func
def _across(view: ViewOnDevice, x: float, y: float):
    """Return the unnormalized direction of the ray at a place of the picture."""
    of_w = wp.vec3(view.row_w[0], view.row_w[1], view.row_w[2])
    of_x = wp.vec3(view.row_x[0], view.row_x[1], view.row_x[2]) - x * of_w
    of_y = wp.vec3(view.row_y[0], view.row_y[1], view.row_y[2]) - y * of_w
    return wp.cross(of_x, of_y)


@wp.func
def direction_at(view: ViewOnDevice, x: float, y: float):
    """The unit direction of the ray at a place of the picture, away from the viewer."""
    direction = wp.normalize(_across(view, x, y))
    if direction[0] * view.row_near[0] + direction[1] * view.row_near[1] + direction[2] * view.row_near[2] < 0.0:
        direction = -direction
    return direction


@wp.func
def ray_at(view: ViewOnDevice, x: float, y: float):
    """(point of the near plane, unit direction) of the ray at a place of the picture."""
    return view.near + x * view.near_x + y * view.near_y, direction_at(view, x, y)


@wp.func
def depth_at(view: ViewOnDevice, place: wp.vec3, direction: wp.vec3):
    """The distance [m] from the near plane to a place, along the ray through it."""
    along = direction[0] * view.row_near[0] + direction[1] * view.row_near[1] + direction[2] * view.row_near[2]
    return wp.dot(view.row_near, wp.vec4(place[0], place[1], place[2], 1.0)) / along


@wp.func
def seen_at(view: ViewOnDevice, place: wp.vec3):
    """Return (x, y of a place in the picture, area in the picture per m² perpendicular to the ray).

    Zero area behind the camera.
    """
    point = wp.vec4(place[0], place[1], place[2], 1.0)
    w = wp.dot(view.row_w, point)
    x = float(0.0)
    y = float(0.0)
    area = float(0.0)
    if w > 0.0:
        x = wp.dot(view.row_x, point) / w
        y = wp.dot(view.row_y, point) / w
        area = wp.length(_across(view, x, y)) / (w * w)
    return x, y, area
