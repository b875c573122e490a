# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of a picture as paths see it: rays through it, and where in it places are."""

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False, "fast_math": True})

AREA = 4.0  # of a picture, whose coordinates are from -1 to 1


@dataclass(frozen=True, eq=False)
class View:
    """What a camera sees in a picture, or in a part of one."""

    world_to_clip: np.ndarray  # (4, 4), of the part

    def ends(self, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (3,) of the near and the far plane that are seen at x and y, from -1 to 1."""
        clip = np.array([[x, y, depth, 1.0] for depth in (-1.0, 1.0)])
        found = clip @ np.linalg.inv(self.world_to_clip).T
        near, far = found[:, :3] / found[:, 3:]
        return near, far


@wp.struct
class ViewOnDevice:
    """`View`: rays from near + x near_x + y near_y to far + x far_x + y far_y, and rows of the matrix."""

    near: wp.vec3
    near_x: wp.vec3
    near_y: wp.vec3
    far: wp.vec3
    far_x: wp.vec3
    far_y: wp.vec3
    row_x: wp.vec4
    row_y: wp.vec4
    row_w: wp.vec4


def on_device(view: View) -> ViewOnDevice:
    """Return a view's struct."""
    found = ViewOnDevice()
    middle, right, top = view.ends(0.0, 0.0), view.ends(1.0, 0.0), view.ends(0.0, 1.0)
    for end, name in enumerate(("near", "far")):
        setattr(found, name, wp.vec3(*middle[end].tolist()))
        setattr(found, f"{name}_x", wp.vec3(*(right[end] - middle[end]).tolist()))
        setattr(found, f"{name}_y", wp.vec3(*(top[end] - middle[end]).tolist()))
    x, y, _z, w = (wp.vec4(*row) for row in np.asarray(view.world_to_clip, float).tolist())
    found.row_x, found.row_y, found.row_w = x, y, w
    return found


@wp.func
def ray_at(view: ViewOnDevice, x: float, y: float):
    """(point of the near plane, unit direction) of the ray at a place of the picture."""
    near = view.near + x * view.near_x + y * view.near_y
    return near, wp.normalize(view.far + x * view.far_x + y * view.far_y - near)


@wp.func
def seen_at(view: ViewOnDevice, place: wp.vec3):
    """(x, y of a place in the picture, picture's area for each m² across the ray there); no area behind the camera."""
    point = wp.vec4(place[0], place[1], place[2], 1.0)
    w = wp.dot(view.row_w, point)
    x = float(0.0)
    y = float(0.0)
    area = float(0.0)
    if w > 0.0:
        x = wp.dot(view.row_x, point) / w
        y = wp.dot(view.row_y, point) / w
        of_w = wp.vec3(view.row_w[0], view.row_w[1], view.row_w[2])
        of_x = (wp.vec3(view.row_x[0], view.row_x[1], view.row_x[2]) - x * of_w) / w
        of_y = (wp.vec3(view.row_y[0], view.row_y[1], view.row_y[2]) - y * of_w) / w
        area = wp.length(wp.cross(of_x, of_y))
    return x, y, area
