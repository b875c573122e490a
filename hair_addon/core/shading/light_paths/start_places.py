# SPDX-License-Identifier: GPL-3.0-or-later
"""Where paths start: places that keep to their strands from frame to frame, and random numbers of paths from there.

Each segment is taken as often as it is large in the picture, in sight or not; of its places those count that rays from
the viewer meet first. A path is known by its segment and by its number there. All its random numbers follow from these,
and its directions are taken in the frame of what it meets. So while a camera or hair moves a little, the same paths
begin at the same places, and their light changes by as little.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from .grid_walk import PASSED, STRAND, Medium, Met, place_on, walk
from .media import launch
from .seen_rays import Seen
from .strand_grid import StrandGrid
from .view import ViewOnDevice, depth_at, direction_at, on_device, seen_at

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LEAST_SHARE = 0.005  # of all paths that a segment may have, where there are too many tries
_MOST_TRIES = 32  # places for each path: in deep hair few are in sight
_MOST_PLACES = wp.constant(64)  # along a segment, where its cells are looked up


@dataclass(frozen=True, eq=False)
class Starts:
    """N places in sight where paths begin, on segments."""

    segments: np.ndarray  # (N,) int32 of a grid
    keys: np.ndarray  # (N,) int32 of random numbers


@wp.func
def start(medium: Medium, view: ViewOnDevice, segment: int, key: int):
    """(`Met` where a path starts, in sight or not; direction there; random state)."""
    state = wp.rand_init(0, key)
    part = wp.randf(state)
    x, y, _area = seen_at(view, (1.0 - part) * medium.points[segment] + part * medium.points[segment + 1])
    place = place_on(medium, segment, part, 2.0 * wp.randf(state) - 1.0, direction_at(view, x, y))
    x, y, _area = seen_at(view, place.position)
    return place, direction_at(view, x, y), state


@wp.func
def _is_in_sight(medium: Medium, view: ViewOnDevice, place: Met, direction: wp.vec3):
    """Whether the ray through a place on a strand meets that first."""
    x, y, area = seen_at(view, place.position)
    if area <= 0.0 or wp.abs(x) >= 1.0 or wp.abs(y) >= 1.0:
        return False
    reach = depth_at(view, place.position, direction)
    if reach <= 0.0:
        return False
    # What is hidden is mostly so by the next strand, which is found soon from here.
    own = medium.strands[place.index]
    before = walk(medium, place.position, -direction, reach, own)
    if before.kind != PASSED:
        return False
    # A place inside another strand is hidden by that strand's side, which rays from inside do not meet.
    radius = medium.radii[place.index]
    met = walk(medium, place.position - reach * direction, direction, reach + radius, -1)
    if met.kind != STRAND:
        return False
    return medium.strands[met.index] == own and wp.length(met.position - place.position) <= radius


@wp.func
def _is_near_seen(medium: Medium, is_seen: wp.array3d[wp.uint8], start: wp.vec3, end: wp.vec3):
    """Whether a segment is in any of the voxels of `voxels_of`."""
    places = 2 + wp.clamp(int(2.0 * wp.length(end - start) / medium.voxel), 0, _MOST_PLACES)
    found = int(0)
    for step in range(places):
        place = start + (end - start) * (float(step) / float(places - 1))
        at = (place - medium.corner) / medium.voxel
        x = wp.clamp(int(at[0]), 0, is_seen.shape[2] - 1)
        y = wp.clamp(int(at[1]), 0, is_seen.shape[1] - 1)
        z = wp.clamp(int(at[2]), 0, is_seen.shape[0] - 1)
        found += int(is_seen[z, y, x])
    return found > 0


@wp.kernel
def _count(
    medium: Medium,
    view: ViewOnDevice,
    is_seen: wp.array3d[wp.uint8],
    density: float,
    most: int,
    seed: int,
    out_count: wp.array[int],
    first: int,
):
    """How many places are tried on each segment: `density` for the picture's unit of area, no more than `most`."""
    segment = first + wp.tid()
    start = medium.points[segment]
    end = medium.points[segment + 1]
    count = int(0)
    if medium.strands[segment] == medium.strands[segment + 1] and _is_near_seen(medium, is_seen, start, end):
        middle = 0.5 * (start + end)
        x, y, area = seen_at(view, middle)
        direction = direction_at(view, x, y)
        if depth_at(view, middle, direction) <= 0.0:
            area = 0.0  # before the near plane it has no bound
        width = medium.radii[segment] + medium.radii[segment + 1]
        wanted = wp.length(wp.cross(end - start, direction)) * width * area * density
        if wanted < float(most):
            state = wp.rand_init(seed, segment)
            count = int(wanted + wp.randf(state))
        else:
            count = most
    out_count[segment] = count


def voxels_of(grid: StrandGrid, places: np.ndarray) -> np.ndarray:
    """(Z, Y, X) uint8: one in voxels in which places (N, 3) are, and in all that touch these.

    Thin hair is missed by samples, and may be in sight beside them.
    """
    x, y, z = grid.shape
    at = grid.voxels_at(places)
    found = np.zeros((z, y, x), np.uint8)
    found[at[:, 2], at[:, 1], at[:, 0]] = 1
    for axis in range(3):
        line = np.moveaxis(found, axis, 0)
        before = line.copy()
        line[1:] |= before[:-1]
        line[:-1] |= before[1:]
    return found


@wp.kernel
def _see(
    medium: Medium,
    view: ViewOnDevice,
    segments: wp.array[int],
    keys: wp.array[int],
    out_is_seen: wp.array[wp.uint8],
    first: int,
):
    place = first + wp.tid()
    met, direction, _state = start(medium, view, segments[place], keys[place])
    if _is_in_sight(medium, view, met, direction):
        out_is_seen[place] = wp.uint8(1)


def _tries(medium, view, is_seen, density, count, seed, device):
    """(segments,) how often each is tried, less often where there would be too many for `count` paths."""
    counts, most = wp.zeros(len(medium.points) - 1, dtype=int), count
    while True:
        launch(_count, len(counts), [medium, view, is_seen, density, most, seed, counts], device)
        numbers = counts.numpy().clip(0, most)
        tries = int(numbers.sum(dtype=np.int64))
        if tries <= _MOST_TRIES * count:
            return numbers
        if most > _LEAST_SHARE * count:
            most //= 4  # of strands next the camera, nearly all of which are beside the picture
        else:
            density *= 0.9 * _MOST_TRIES * count / tries


def of_seen(
    medium: Medium, grid: StrandGrid, seen: Seen, voxels: np.ndarray, count: int, seed: int, device: wp.DeviceLike
) -> Starts:
    """About `count` `Starts`; voxels: of what is seen, by `voxels_of`."""
    seen_in, is_seen = on_device(seen.view), wp.array(voxels, dtype=wp.uint8)
    numbers = _tries(medium, seen_in, is_seen, count / (len(seen.segments) * seen.area), count, seed, device)
    segments = np.flatnonzero(numbers)
    each = np.repeat(segments, numbers[segments])
    firsts = np.cumsum(numbers[segments]) - numbers[segments]
    keys = hashed(each, seed + 1, np.arange(len(each)) - np.repeat(firsts, numbers[segments])).astype(np.int32)
    each = each.astype(np.int32)
    in_sight = wp.zeros(len(each), dtype=wp.uint8)
    launch(_see, len(each), [medium, seen_in, wp.array(each), wp.array(keys), in_sight], device)
    is_start = in_sight.numpy().astype(bool)
    return Starts(each[is_start], keys[is_start])


def hashed(values: np.ndarray, seed: int, number: int | np.ndarray = 0) -> np.ndarray:
    """Return (N,) uint32 hashes of (N,) integers, a seed and second (N,) integers: the finalizer of [Steele14]."""
    bits = np.asarray(values).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    bits = bits + np.asarray(number).astype(np.uint64) * np.uint64(0xD1B54A32D192ED03)
    bits = bits + np.uint64((seed * 0x8CB92BA72F3D8DD7) % 2**64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    return (bits ^ (bits >> np.uint64(31))).astype(np.uint32)
