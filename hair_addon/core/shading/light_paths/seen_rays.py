# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible strands in a picture, found by tracing rays or from drawn samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from ...kernels import parallel, running_sums
from ...kernels.checks import require_count, require_indices
from .grid_walk import FAR, STRAND, Medium, walk
from .media import launch, mesh_of, unlit_medium_of
from .strand_grid import StrandGrid
from .view import AREA, View, ViewOnDevice, on_device, ray_at

wp.set_module_options({"enable_backward": False, "fast_math": True})


@dataclass(frozen=True, eq=False)
class Seen:
    """Visible hair at N samples of a picture; arrays are on the device of the grid."""

    view: View
    segments: wp.array[int]  # (N,) of the grid, visible in the samples
    places: wp.array[wp.vec3]  # (N,) [m] there
    drawn: wp.array[wp.vec3]  # (N,) radiance drawn without paths
    area: float  # area of the picture represented by each sample


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
    hit = walk(medium, position, direction, FAR, -1)
    out_segment[path] = -1
    if hit.kind == STRAND:
        out_segment[path] = hit.index
    out_position[path] = hit.position


def hits_of(
    grid: StrandGrid, corners: np.ndarray, view: View, ray_count: int, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return (segments (N,), places (N, 3)) of strands that rays hit before a surface.

    corners: (3 F, 3) of the surfaces' triangles; ray_count: over the whole picture, rounded to a square. Rays that hit
    no strand are left out.
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
    """Return `Seen` with the segments and places of `hits_of`, and black drawn light."""
    segments, places = hits_of(grid, corners, view, ray_count, seed)
    area = AREA / max(1, round(ray_count**0.5)) ** 2
    with wp.ScopedDevice(grid.device):
        drawn = wp.zeros(len(segments), dtype=wp.vec3)
        return Seen(view, wp.array(segments, dtype=int), wp.array(places, dtype=wp.vec3), drawn, area)


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


@wp.kernel
def _number(
    picture: wp.array[wp.uint32],
    drawn_ranges: wp.array2d[int],
    out_segments: wp.array[int],
    out_is_hair: wp.array[int],
    first: int,
):
    """Find the segment of the grid that each sample shows; drawn_ranges: of each system, from `shown_in`."""
    sample = first + wp.tid()
    shown = picture[sample]
    for system in range(drawn_ranges.shape[0]):
        begin = wp.uint32(drawn_ranges[system, 0])
        if shown >= begin and shown - begin < wp.uint32(drawn_ranges[system, 1]):
            segment = int(shown - begin)
            of_strand = drawn_ranges[system, 2]
            point_count = drawn_ranges[system, 4]
            # The middle of the drawn segment, converted from the drawn to the grid's number of segments.
            along = (2 * (segment % of_strand) + 1) * (point_count - 1) / (2 * of_strand)
            strand = segment / of_strand / drawn_ranges[system, 3]
            out_segments[sample] = drawn_ranges[system, 5] + strand * point_count + along
            out_is_hair[sample] = 1


@wp.kernel
def _list(
    segments: wp.array[int],
    is_hair: wp.array[int],
    ends: wp.array[int],
    color: wp.array[wp.vec4],
    width: int,
    height: int,
    out_segments: wp.array[int],
    out_at: wp.array[wp.vec2],
    out_drawn: wp.array[wp.vec3],
    first: int,
):
    sample = first + wp.tid()
    if is_hair[sample] == 1:
        index = ends[sample] - 1
        out_segments[index] = segments[sample]
        x = float(2 * (sample % width) + 1) / float(width) - 1.0
        out_at[index] = wp.vec2(x, float(2 * (sample / width) + 1) / float(height) - 1.0)
        out_drawn[index] = wp.vec3(color[sample][0], color[sample][1], color[sample][2])


def shown_in(
    grid: StrandGrid, view: View, picture: np.ndarray, color: np.ndarray, ranges: Sequence[tuple[int, int, int]]
) -> Seen:
    """Return the `Seen` of a picture of indices of drawn segments (H, W) uint32 and their radiance (H, W, 4) float32.

    ranges: for each system (index of its first segment, number of segments, segments per strand); other indices are not
    hair. Places are the points of segments nearest to the rays through the samples' centers.
    """
    height, width = picture.shape
    require_count("colors", color.size, 4 * picture.size)
    require_count("systems in the picture", len(ranges), len(grid.thinned))
    ends_of_systems = [*(system.first_point for system in grid.thinned[1:]), len(grid.points)]
    rows = []
    for (begin, count, of_strand), system, end in zip(ranges, grid.thinned, ends_of_systems, strict=True):
        if count:
            last_strand = (count // of_strand - 1) // system.stride
            last = system.first_point + last_strand * system.point_count + system.point_count - 1
            require_indices("points", [last], end)
        rows.append((begin, count, max(of_strand, 1), system.stride, system.point_count, system.first_point))
    device = grid.device
    with wp.ScopedDevice(device):
        numbers, is_hair = (wp.zeros(picture.size, dtype=int) for _ in range(2))
        drawn_ranges = wp.array(np.array(rows, np.int32).reshape(-1, 6), dtype=int)
        shown = wp.array(np.ascontiguousarray(picture).reshape(-1), dtype=wp.uint32, copy=False)
        colors = wp.array(np.ascontiguousarray(color).reshape(-1, 4), dtype=wp.vec4, copy=False)
        launch(_number, picture.size, [shown, drawn_ranges, numbers, is_hair], device)
        ends, count = running_sums.ends_of(is_hair)
        segments, at = wp.empty(count, dtype=int), wp.empty(count, dtype=wp.vec2)
        places, drawn = (wp.empty(count, dtype=wp.vec3) for _ in range(2))
        given = [numbers, is_hair, ends, colors, width, height, segments, at, drawn]
        launch(_list, picture.size, given, device)
        given = [on_device(view), grid.points, parallel.Rows(segments), parallel.Rows(at)]
        parallel.launch(_place, count, given, [places], device)
        return Seen(view, segments, places, drawn, AREA / picture.size)
