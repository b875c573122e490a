# SPDX-License-Identifier: GPL-3.0-or-later
"""Start places of paths, which stay on their strands from frame to frame, and the random numbers of these paths.

The number of tried places on a segment is proportional to its area in the picture and to `start_density`; visible
places become starts. A path is identified by its segment and its index there, which determine all its random numbers,
and its directions are sampled in the frame of the strand or surface that it hits. When a camera or hair moves a little,
the same paths therefore begin at the same places, and their light changes little.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...kernels import kernel_cache, running_sums
from ...kernels.checks import require_count
from .grid_walk import STRAND, Hit, Medium, is_blocked, place_on, walk
from .media import launch
from .seen_rays import Seen
from .start_density import EVEN, density_of, level_at
from .view import ViewOnDevice, depth_at, direction_at, on_device, seen_at

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LEAST_SHARE = 0.005  # fraction of all paths that a segment may always have, even if there are too many tries
_MOST_TRIES = 32  # tried places per path: in deep hair few are visible
_MOST_PLACES = wp.constant(64)  # points along a segment at which voxels are looked up
_MOST_PARTS = 4096  # maximum number of parts of a sum of tries


@dataclass(frozen=True, eq=False)
class Starts:
    """N visible places on segments where paths begin."""

    segments: wp.array[int]  # (N,) of a grid
    keys: wp.array[int]  # (N,) random states
    weights: wp.array[float]  # (N,) reciprocal densities


@wp.func
def start(medium: Medium, view: ViewOnDevice, segment: int, key: int):
    """Return (`Hit` where a path starts, visible or not; direction of the ray there; random state)."""
    state = wp.rand_init(0, key)
    part = wp.randf(state)
    x, y, _area = seen_at(view, (1.0 - part) * medium.points[segment] + part * medium.points[segment + 1])
    place = place_on(medium, segment, part, 2.0 * wp.randf(state) - 1.0, direction_at(view, x, y))
    x, y, _area = seen_at(view, place.position)
    return place, direction_at(view, x, y), state


@wp.func
def _is_in_sight(medium: Medium, view: ViewOnDevice, place: Hit, direction: wp.vec3):
    """Whether the ray through a place on a strand hits that place first."""
    x, y, area = seen_at(view, place.position)
    if area <= 0.0 or wp.abs(x) >= 1.0 or wp.abs(y) >= 1.0:
        return False
    reach = depth_at(view, place.position, direction)
    if reach <= 0.0:
        return False
    # Places are mostly hidden by the next strand, which a short ray from here hits.
    own = medium.strands[place.index]
    if is_blocked(medium, place.position, -direction, reach, own):
        return False
    # A place inside another strand is hidden by that strand's side, which rays from inside do not hit.
    radius = medium.radii[place.index]
    hit = walk(medium, place.position - reach * direction, direction, reach + radius, -1)
    if hit.kind != STRAND:
        return False
    return medium.strands[hit.index] == own and wp.length(hit.position - place.position) <= radius


@wp.kernel
def _measure(
    medium: Medium,
    view: ViewOnDevice,
    levels: wp.array3d[wp.uint8],
    out_areas: wp.array[float],
    first: int,
):
    """Compute the area of each segment in the picture, times the density of the segment's level."""
    segment = first + wp.tid()
    start = medium.points[segment]
    end = medium.points[segment + 1]
    found = float(0.0)
    level = level_at(levels, medium.corner, medium.voxel, start, end, _MOST_PLACES)
    if level > 0 and medium.strands[segment] == medium.strands[segment + 1]:
        middle = 0.5 * (start + end)
        x, y, area = seen_at(view, middle)
        direction = direction_at(view, x, y)
        if depth_at(view, middle, direction) <= 0.0:
            area = 0.0  # unbounded in front of the near plane
        width = medium.radii[segment] + medium.radii[segment + 1]
        found = wp.length(wp.cross(end - start, direction)) * width * area * density_of(level)
    out_areas[segment] = found


@wp.kernel
def _count(areas: wp.array[float], density: float, most: int, seed: int, out_count: wp.array[int], first: int):
    """Count the places to try on each segment: at most `most`, and `density` per unit of `areas_of`."""
    segment = first + wp.tid()
    wanted = areas[segment] * density
    count = int(0)
    if wanted < float(most):
        if wanted > 0.0:
            state = wp.rand_init(seed, segment)
            count = int(wanted + wp.randf(state))
    else:
        count = most
    out_count[segment] = count


@wp.kernel
def _weigh(medium: Medium, levels: wp.array3d[wp.uint8], segments: wp.array[int], out_weights: wp.array[float]):
    path = wp.tid()
    segment = segments[path]
    start = medium.points[segment]
    end = medium.points[segment + 1]
    level = level_at(levels, medium.corner, medium.voxel, start, end, _MOST_PLACES)
    out_weights[path] = 1.0 / density_of(level)


@wp.func
def voxel_at(place: wp.vec3, corner: wp.vec3, voxel: float, shape: wp.vec3i):
    """Return indices along X, Y, Z of the voxel that contains a place.

    The nearest voxel for places outside the grid.
    """
    at = (place - corner) * (1.0 / voxel)
    found = wp.vec3i(0, 0, 0)
    for axis in range(3):
        found[axis] = int(wp.clamp(at[axis], 0.0, float(shape[axis] - 1)))
    return found


@wp.kernel
def _mark(places: wp.array[wp.vec3], corner: wp.vec3, voxel: float, out_holds: wp.array3d[wp.uint8]):
    shape = wp.vec3i(out_holds.shape[2], out_holds.shape[1], out_holds.shape[0])
    at = voxel_at(places[wp.tid()], corner, voxel, shape)
    out_holds[at[2], at[1], at[0]] = wp.uint8(1)


@wp.kernel
def _spread(holds: wp.array3d[wp.uint8], out_touches: wp.array3d[wp.uint8]):
    z, y, x = wp.tid()
    if holds[z, y, x] > wp.uint8(0):
        for layer in range(wp.max(z - 1, 0), wp.min(z + 2, holds.shape[0])):
            for row in range(wp.max(y - 1, 0), wp.min(y + 2, holds.shape[1])):
                for column in range(wp.max(x - 1, 0), wp.min(x + 2, holds.shape[2])):
                    out_touches[layer, row, column] = wp.uint8(EVEN)


def voxels_of(medium: Medium, places: wp.array[wp.vec3]) -> tuple[wp.array3d[wp.uint8], int]:
    """Return ((Z, Y, X): level of even density in voxels that contain places (N,) and in their neighbors; number of
    voxels with places).

    Samples miss thin hair, which may be visible beside them.
    """
    x, y, z = (int(count) for count in medium.shape)
    holds, touches = (wp.zeros((z, y, x), dtype=wp.uint8, device=places.device) for _ in range(2))
    kernel_cache.launch(_mark, len(places), [places, medium.corner, medium.voxel], [holds], places.device)
    kernel_cache.launch(_spread, (z, y, x), [holds], [touches], places.device)
    return touches, int(np.count_nonzero(holds.numpy()))


@wp.kernel
def _see(
    medium: Medium,
    view: ViewOnDevice,
    segments: wp.array[int],
    keys: wp.array[int],
    out_is_seen: wp.array[int],
    first: int,
):
    place = first + wp.tid()
    hit, direction, _state = start(medium, view, segments[place], keys[place])
    if _is_in_sight(medium, view, hit, direction):
        out_is_seen[place] = 1


@wp.kernel
def _add_counts(counts: wp.array[int], part_size: int, out_totals: wp.array[wp.int64]):
    part = wp.tid()
    total = wp.int64(0)
    for segment in range(part * part_size, wp.min((part + 1) * part_size, counts.shape[0])):
        total += wp.int64(counts[segment])
    out_totals[part] = total


def _total(counts):
    """Return the sum of (N,) integers, which may exceed their type."""
    size = max(-(-len(counts) // _MOST_PARTS), 1)
    totals = wp.empty(-(-len(counts) // size), dtype=wp.int64)
    kernel_cache.launch(_add_counts, len(totals), [counts, size], [totals], counts.device)
    return int(totals.numpy().sum())


def _tries(areas, density, count, seed):
    """Return (segments,) the number of tried places of each, reduced if there would be too many for `count` paths."""
    counts, most = wp.empty(len(areas), dtype=int), count
    while True:
        launch(_count, len(counts), [areas, density, most, seed, counts], areas.device)
        tries = _total(counts)
        if tries <= _MOST_TRIES * count:
            return counts
        if most > _LEAST_SHARE * count:
            most //= 4  # of strands near the camera, most of which are outside the picture
        else:
            density *= 0.9 * _MOST_TRIES * count / tries


@wp.func
def _hashed(value: wp.uint64, number: wp.uint64, seed: wp.uint64):
    """Return a hash of two integers and the `_product` of a seed: the finalizer of [Steele14]."""
    bits = value * wp.uint64(0x9E3779B97F4A7C15) + number * wp.uint64(0xD1B54A32D192ED03) + seed
    bits = (bits ^ (bits >> wp.uint64(30))) * wp.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> wp.uint64(27))) * wp.uint64(0x94D049BB133111EB)
    return wp.uint32(bits ^ (bits >> wp.uint64(31)))


@wp.kernel
def _list(
    counts: wp.array[int],
    ends: wp.array[int],
    seed: wp.uint64,
    out_segments: wp.array[int],
    out_keys: wp.array[int],
    first: int,
):
    segment = first + wp.tid()
    at = ends[segment] - counts[segment]
    for number in range(counts[segment]):
        out_segments[at + number] = segment
        out_keys[at + number] = int(_hashed(wp.uint64(segment), wp.uint64(number), seed))


@wp.func
def _spread_bits(value: int):
    """Return the lowest ten bits of a number with two zeros between each two."""
    bits = value & 1023
    bits = (bits | (bits << 16)) & 0x030000FF
    bits = (bits | (bits << 8)) & 0x0300F00F
    bits = (bits | (bits << 4)) & 0x030C30C3
    return (bits | (bits << 2)) & 0x09249249


@wp.kernel
def _code(
    points: wp.array[wp.vec3],
    corner: wp.vec3,
    voxel: float,
    shape: wp.vec3i,
    segments: wp.array[int],
    out_codes: wp.array[int],
    out_order: wp.array[int],
):
    """Compute the place of each segment's voxel along a curve through nearby voxels [Morton66]."""
    place = wp.tid()
    at = voxel_at(points[segments[place]], corner, voxel, shape)
    out_codes[place] = _spread_bits(at[0]) | (_spread_bits(at[1]) << 1) | (_spread_bits(at[2]) << 2)
    out_order[place] = place


@wp.kernel
def _take(
    order: wp.array[int],
    segments: wp.array[int],
    keys: wp.array[int],
    out_segments: wp.array[int],
    out_keys: wp.array[int],
):
    place = wp.tid()
    out_segments[place] = segments[order[place]]
    out_keys[place] = keys[order[place]]


def _by_voxels(medium, segments, keys):
    """Return segments (N,) and keys (N,) in the order of nearby voxels, whose rays read the same memory."""
    count, device = len(segments), segments.device
    codes, order = (wp.empty(2 * count, dtype=int, device=device) for _ in range(2))
    found = wp.empty_like(segments), wp.empty_like(keys)
    if count:
        given = [medium.points, medium.corner, medium.voxel, medium.shape, segments]
        kernel_cache.launch(_code, count, given, [codes, order], device)
        most = 3 * max(int(side) - 1 for side in medium.shape).bit_length()
        wp.utils.radix_sort_pairs(codes, order, count, end_bit=max(most, 1))
        kernel_cache.launch(_take, count, [order, segments, keys], found, device)
    return found


@wp.kernel
def _keep(
    segments: wp.array[int],
    keys: wp.array[int],
    is_kept: wp.array[int],
    ends: wp.array[int],
    out_segments: wp.array[int],
    out_keys: wp.array[int],
):
    place = wp.tid()
    if is_kept[place] == 1:
        out_segments[ends[place] - 1] = segments[place]
        out_keys[ends[place] - 1] = keys[place]


def areas_of(medium: Medium, seen: Seen, levels: wp.array3d[wp.uint8]) -> wp.array[float]:
    """Return the areas (segments,) of a medium's segments in the picture, times the densities of their levels.

    levels: of voxels with visible hair, from `voxels_of` or `start_density.set_levels`.
    """
    device = medium.points.device
    for side, wanted in zip(levels.shape[::-1], medium.shape, strict=True):
        require_count("voxels", side, int(wanted))
    areas = wp.empty(max(len(medium.points) - 1, 0), dtype=float, device=device)
    launch(_measure, len(areas), [medium, on_device(seen.view), levels, areas], device)
    return areas


def of_seen(
    medium: Medium, seen: Seen, levels: wp.array3d[wp.uint8], areas: wp.array[float], count: int, seed: int
) -> Starts:
    """Return about `count` `Starts`, on the device of a medium; areas: `areas_of` these levels."""
    device, seen_in = medium.points.device, on_device(seen.view)
    for side, wanted in zip(levels.shape[::-1], medium.shape, strict=True):
        require_count("voxels", side, int(wanted))
    require_count("areas", len(areas), max(len(medium.points) - 1, 0))
    with wp.ScopedDevice(device):
        counts = _tries(areas, count / (len(seen.segments) * seen.area), count, seed)
        ends, tries = running_sums.ends_of(counts)
        segments, keys, in_sight = (wp.zeros(tries, dtype=int) for _ in range(3))
        launch(_list, len(counts), [counts, ends, _product(seed + 1), segments, keys], device)
        segments, keys = _by_voxels(medium, segments, keys)
        launch(_see, tries, [medium, seen_in, segments, keys, in_sight], device)
        ends, found = running_sums.ends_of(in_sight)
        starts = Starts(wp.empty(found, dtype=int), wp.empty(found, dtype=int), wp.empty(found, dtype=float))
        given = [segments, keys, in_sight, ends]
        kernel_cache.launch(_keep, tries, given, [starts.segments, starts.keys], device)
        kernel_cache.launch(_weigh, found, [medium, levels, starts.segments], [starts.weights], device)
        return starts


def _product(seed):
    """Return the product of a seed for `_hashed`."""
    return wp.uint64((seed * 0x8CB92BA72F3D8DD7) % 2**64)
