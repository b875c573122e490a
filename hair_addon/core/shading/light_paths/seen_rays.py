# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that rays of a picture meet, without drawing any."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from .gather import Seen, launch, medium_of, mesh_of
from .grid_walk import FAR, STRAND, Medium, walk
from .strand_grid import StrandGrid

wp.set_module_options({"enable_backward": False, "fast_math": True})


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a picture: near + x near_x + y near_y to far + x far_x + y far_y, x and y from 0 to 1; (3,) each [m]."""

    near: np.ndarray
    near_x: np.ndarray
    near_y: np.ndarray
    far: np.ndarray
    far_x: np.ndarray
    far_y: np.ndarray


@wp.struct
class _Rays:
    near: wp.vec3
    near_x: wp.vec3
    near_y: wp.vec3
    far: wp.vec3
    far_x: wp.vec3
    far_y: wp.vec3
    side: int  # rays along each of x and y


@wp.kernel
def _find(
    medium: Medium,
    rays: _Rays,
    seed: int,
    out_segment: wp.array[int],
    out_position: wp.array[wp.vec3],
    out_viewer: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    state = wp.rand_init(seed, path)
    x = (float(path % rays.side) + wp.randf(state)) / float(rays.side)
    y = (float(path / rays.side) + wp.randf(state)) / float(rays.side)
    position = rays.near + x * rays.near_x + y * rays.near_y
    direction = wp.normalize(rays.far + x * rays.far_x + y * rays.far_y - position)
    met = walk(medium, position, direction, FAR, -1)
    out_segment[path] = -1
    if met.kind == STRAND:
        out_segment[path] = met.index
    out_position[path] = met.position
    out_viewer[path] = -direction


def met_by(
    grid: StrandGrid, corners: np.ndarray, rays: Rays, ray_count: int, seed: int = 0, device: wp.DeviceLike = "cpu"
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(segments (N,), places (N, 3), unit directions to the viewer) where rays meet strands before a surface, triangles
    of corners (3 F, 3).

    ray_count: of rays over the picture, rounded to a square; those that meet no strand are left out.
    """
    side = max(1, round(ray_count**0.5))
    with wp.ScopedDevice(device):
        mesh = mesh_of(corners)
        medium = medium_of(grid, mesh, np.zeros((len(corners), 3)), np.zeros((len(corners) // 3, 3)))
        segments = wp.full(side * side, -1, dtype=int)
        positions, viewers = (wp.zeros(side * side, dtype=wp.vec3) for _ in range(2))
        lens = _Rays()
        for name in ("near", "near_x", "near_y", "far", "far_x", "far_y"):
            setattr(lens, name, wp.vec3(*map(float, getattr(rays, name))))
        lens.side = side
        launch(_find, side * side, [medium, lens, seed, segments, positions, viewers], device)
        found, positions, viewers = (array.numpy() for array in (segments, positions, viewers))
    is_hair = found >= 0
    return found[is_hair], positions[is_hair], viewers[is_hair]


def seen_by(
    grid: StrandGrid, corners: np.ndarray, rays: Rays, ray_count: int, seed: int = 0, device: wp.DeviceLike = "cpu"
) -> Seen:
    """`Seen` of `met_by`: nothing is drawn of the strands yet."""
    segments, places, viewers = met_by(grid, corners, rays, ray_count, seed, device)
    normal = np.cross(rays.near_x, rays.near_y)
    before = ((places - rays.near) @ normal / (viewers @ normal))[:, None]
    areas = _areas(rays, places, viewers) / max(1, round(ray_count**0.5)) ** 2
    return Seen(segments, places - before * viewers, viewers, areas, np.zeros((len(segments), 3), np.float32))


def _areas(rays, positions, viewers):
    """(N,) [m²] across each ray of all the picture, at the ray's distance."""
    normal = np.cross(rays.near_x, rays.near_y)
    part = ((positions - rays.near) @ normal / ((rays.far - rays.near) @ normal))[:, None]
    x, y = (near + part * (far - near) for near, far in ((rays.near_x, rays.far_x), (rays.near_y, rays.far_y)))
    return np.abs((np.cross(x, y) * viewers).sum(axis=1))
