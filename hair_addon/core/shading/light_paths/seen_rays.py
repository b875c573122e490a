# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that rays of a picture meet: without drawing any, or at samples that were drawn."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...kernels import parallel
from ...kernels.checks import require_count, require_indices
from .grid_walk import FAR, STRAND, Medium, walk
from .media import launch, mesh_of, unlit_medium_of
from .strand_grid import StrandGrid
from .view import AREA, View, ViewOnDevice, on_device, ray_at

wp.set_module_options({"enable_backward": False, "fast_math": True})


@dataclass(frozen=True, eq=False)
class Seen:
    """Hair that is seen in a picture, at N samples of it."""

    view: View
    segments: np.ndarray  # (N,) int32 of a grid, which samples show
    places: np.ndarray  # (N, 3) [m] there
    drawn: np.ndarray  # (N, 3) radiance that is drawn there without paths
    area: float  # of the picture that each sample stands for


@wp.kernel
def _find(
    medium: Medium,
    view: ViewOnDevice,
    seed: int,
    side: int,
    out_segment: wp.array[int],
    out_position: wp.array[wp.vec3],
    first: int,
):
    path = first + wp.tid()
    state = wp.rand_init(seed, path)
    x = 2.0 * (float(path % side) + wp.randf(state)) / float(side) - 1.0
    y = 2.0 * (float(path / side) + wp.randf(state)) / float(side) - 1.0
    position, direction = ray_at(view, x, y)
    met = walk(medium, position, direction, FAR, -1)
    out_segment[path] = -1
    if met.kind == STRAND:
        out_segment[path] = met.index
    out_position[path] = met.position


def met_by(
    grid: StrandGrid, corners: np.ndarray, view: View, ray_count: int, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """(segments (N,), places (N, 3)) where rays meet strands before a surface, triangles of corners (3 F, 3).

    ray_count: of rays over the picture, rounded to a square; those that meet no strand are left out.
    """
    side = max(1, round(ray_count**0.5))
    device = grid.device
    with wp.ScopedDevice(device):
        mesh = mesh_of(corners)
        medium = unlit_medium_of(grid, mesh)
        segments, positions = wp.full(side * side, -1, dtype=int), wp.zeros(side * side, dtype=wp.vec3)
        launch(_find, side * side, [medium, on_device(view), seed, side, segments, positions], device)
        found, places = segments.numpy(), positions.numpy()
    is_hair = found >= 0
    return found[is_hair], places[is_hair]


def seen_by(grid: StrandGrid, corners: np.ndarray, view: View, ray_count: int, seed: int = 0) -> Seen:
    """`Seen` of `met_by`: nothing is drawn of the strands yet."""
    segments, places = met_by(grid, corners, view, ray_count, seed)
    area = AREA / max(1, round(ray_count**0.5)) ** 2
    return Seen(view, segments, places, np.zeros((len(segments), 3), np.float32), area)


@wp.kernel
def _place(
    view: ViewOnDevice,
    points: wp.array[wp.vec3],
    segments: wp.array[int],
    at: wp.array[wp.vec2],
    out_place: wp.array[wp.vec3],
):
    sample = wp.tid()
    position, direction = ray_at(view, at[sample][0], at[sample][1])
    start = points[segments[sample]]
    along = points[segments[sample] + 1] - start
    normal = wp.cross(direction, along)
    squared = wp.dot(normal, normal)
    part = float(0.5)
    if squared > 0.0:
        part = wp.clamp(wp.dot(wp.cross(start - position, direction), normal) / squared, 0.0, 1.0)
    out_place[sample] = start + part * along


def places_at(grid: StrandGrid, view: View, segments: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(N, 3) places of segments (N,) that are nearest to the rays at (N, 2) of a picture, from -1 to 1."""
    require_count("places in the picture", len(at), len(segments))
    require_indices("segments", segments, len(grid.points) - 1)
    device = grid.device
    with wp.ScopedDevice(device):
        places = wp.zeros(len(segments), dtype=wp.vec3)
        rows = [wp.array(segments.astype(np.int32), dtype=int), wp.array(at.astype(np.float32), dtype=wp.vec2)]
        given = [on_device(view), grid.points, *map(parallel.Rows, rows)]
        parallel.launch(_place, len(segments), given, [places], device)
        return places.numpy()
