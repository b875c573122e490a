# SPDX-License-Identifier: GPL-3.0-or-later
"""Ratios without holes from sums over paths by voxel: voxels with few paths are blended with larger voxels.

All computations run on the device of the sums. Each thread adds in a fixed order, so the same sums give the same bits.
"""

import numpy as np
import warp as wp

from ...kernels import kernel_cache, parallel
from ...kernels.checks import require_count

wp.set_module_options({"enable_backward": False})

# RGB of four sums: light of paths, and the same in uniform light; drawn light, and the same in uniform light.
CHANNELS = 12
MOST_PRIOR, _LEAST_PRIOR = 128.0, 8.0  # weight of the ratio of larger voxels, in paths
_FALL = 2000.0  # product of that weight and the paths of a voxel between these limits
_LEAST_VOXELS = 4096  # fewer are not worth a thread
_MOST_PARTS = 512  # maximum number of parts of a sum

rgb = wp.types.vector(length=3, dtype=wp.float64)


@wp.func
def _rgb_at(sums: wp.array4d[wp.float64], z: int, y: int, x: int, first: int):
    return rgb(sums[z, y, x, first], sums[z, y, x, first + 1], sums[z, y, x, first + 2])


@wp.kernel
def _mark(
    sums: wp.array4d[wp.float64],
    out_layers: wp.array[wp.uint8],
    out_rows: wp.array[wp.uint8],
    out_columns: wp.array[wp.uint8],
    first: int,
):
    """Mark the layers, rows and columns with any paths or samples."""
    voxel = first + wp.tid()
    x = voxel % sums.shape[2]
    y = voxel / sums.shape[2] % sums.shape[1]
    z = voxel / (sums.shape[2] * sums.shape[1])
    if sums[z, y, x, 3] > wp.float64(0.0) or sums[z, y, x, 9] > wp.float64(0.0):
        out_layers[z] = wp.uint8(1)
        out_rows[y] = wp.uint8(1)
        out_columns[x] = wp.uint8(1)


@wp.kernel
def _halve(sums: wp.array4d[wp.float64], shift: wp.vec3i, out_sums: wp.array4d[wp.float64], first: int):
    """Sum blocks of 2 × 2 × 2 voxels; the first block lacks its lower half along axes whose shift is 1."""
    voxel = first + wp.tid()
    x = voxel % out_sums.shape[2]
    y = voxel / out_sums.shape[2] % out_sums.shape[1]
    z = voxel / (out_sums.shape[2] * out_sums.shape[1])
    for channel in range(out_sums.shape[3]):
        total = wp.float64(0.0)
        for corner in range(8):
            at_z = 2 * z + corner / 4 - shift[0]
            at_y = 2 * y + corner / 2 % 2 - shift[1]
            at_x = 2 * x + corner % 2 - shift[2]
            is_low = at_z >= 0 and at_y >= 0 and at_x >= 0
            if is_low and at_z < sums.shape[0] and at_y < sums.shape[1] and at_x < sums.shape[2]:
                total += sums[at_z, at_y, at_x, channel]
        out_sums[z, y, x, channel] = total


@wp.func
def _place(at: int, shift: int, count: int):
    """Return (voxel below, voxel above, fraction between them) of a voxel's center among `count` voxels of twice the
    size.
    """
    place = wp.float64(0.5) * (wp.float64(at + shift) + wp.float64(0.5)) - wp.float64(0.5)
    below = wp.clamp(int(wp.floor(place)), 0, count - 1)
    part = wp.clamp(place - wp.float64(below), wp.float64(0.0), wp.float64(1.0))
    return below, wp.min(below + 1, count - 1), part


@wp.func
def _between(
    ratios: wp.array4d[wp.float64],
    channel: int,
    z: int,
    y: int,
    low: int,
    high: int,
    part: wp.float64,
):
    return (wp.float64(1.0) - part) * ratios[z, y, low, channel] + part * ratios[z, y, high, channel]


@wp.kernel
def _refine(
    sums: wp.array4d[wp.float64],
    shift: wp.vec3i,
    total: wp.array4d[wp.float64],
    prior: wp.float64,
    around: wp.array4d[wp.float64],
    out_ratios: wp.array4d[wp.float64],
    first: int,
):
    """Compute the ratios of voxels from the ratios of voxels of twice the size, interpolated linearly."""
    voxel = first + wp.tid()
    x = voxel % sums.shape[2]
    y = voxel / sums.shape[2] % sums.shape[1]
    z = voxel / (sums.shape[2] * sums.shape[1])
    low_z, high_z, part_z = _place(z, shift[0], around.shape[0])
    low_y, high_y, part_y = _place(y, shift[1], around.shape[1])
    low_x, high_x, part_x = _place(x, shift[2], around.shape[2])
    one = wp.float64(1.0)
    for channel in range(around.shape[3]):
        below = (one - part_y) * _between(around, channel, low_z, low_y, low_x, high_x, part_x)
        below += part_y * _between(around, channel, low_z, high_y, low_x, high_x, part_x)
        above = (one - part_y) * _between(around, channel, high_z, low_y, low_x, high_x, part_x)
        above += part_y * _between(around, channel, high_z, high_y, low_x, high_x, part_x)
        ratio = (one - part_z) * below + part_z * above
        of = 6 * (channel / 3) + channel % 3
        weight = wp.max(prior * total[0, 0, 0, of + 3], wp.float64(1e-12))
        ratio = (sums[z, y, x, of] + weight * ratio) / (sums[z, y, x, of + 3] + weight)
        out_ratios[z, y, x, channel] = ratio


@wp.kernel
def _divide(total: wp.array4d[wp.float64], out_ratios: wp.array4d[wp.float64]):
    channel = wp.tid()
    of = 6 * (channel / 3) + channel % 3
    out_ratios[0, 0, 0, channel] = total[0, 0, 0, of] / wp.max(total[0, 0, 0, of + 3], wp.float64(1e-12))


@wp.func
def _known_at(sums: wp.array4d[wp.float64], voxel: int):
    """Return (light, uniform light, drawn light scaled to that uniform light) of a voxel in which all are known.

    Else zero uniform light.
    """
    x = voxel % sums.shape[2]
    y = voxel / sums.shape[2] % sums.shape[1]
    z = voxel / (sums.shape[2] * sums.shape[1])
    light = rgb()
    even = rgb()
    drawn = rgb()
    if sums[z, y, x, 3] > wp.float64(0.0) and sums[z, y, x, 9] > wp.float64(0.0):
        light = _rgb_at(sums, z, y, x, 0)
        even = _rgb_at(sums, z, y, x, 3)
        drawn = _rgb_at(sums, z, y, x, 6)
        there = _rgb_at(sums, z, y, x, 9)
        for channel in range(3):
            drawn[channel] *= even[channel] / wp.max(there[channel], wp.float64(1e-12))
    return light, even, drawn


@wp.kernel
def _add_known(sums: wp.array4d[wp.float64], part_size: int, out_parts: wp.array2d[wp.float64]):
    """Sum light, uniform light and drawn light (3 × RGB) of a part of all voxels."""
    part = wp.tid()
    lights = rgb()
    evens = rgb()
    drawns = rgb()
    voxels = sums.shape[0] * sums.shape[1] * sums.shape[2]
    for voxel in range(part * part_size, wp.min((part + 1) * part_size, voxels)):
        light, even, drawn = _known_at(sums, voxel)
        lights += light
        evens += even
        drawns += drawn
    for channel in range(3):
        out_parts[part, channel] = lights[channel]
        out_parts[part, 3 + channel] = evens[channel]
        out_parts[part, 6 + channel] = drawns[channel]


@wp.kernel
def _add_parts(parts: wp.array2d[wp.float64], out_totals: wp.array[wp.float64]):
    channel = wp.tid()
    total = wp.float64(0.0)
    for part in range(parts.shape[0]):
        total += parts[part, channel]
    out_totals[channel] = total


@wp.kernel
def _add_products(
    sums: wp.array4d[wp.float64], totals: wp.array[wp.float64], part_size: int, out_parts: wp.array2d[wp.float64]
):
    """Sum (light × drawn, drawn²) / uniform light of a part of all voxels, of the deviations from uniform light."""
    part = wp.tid()
    product = wp.float64(0.0)
    square = wp.float64(0.0)
    voxels = sums.shape[0] * sums.shape[1] * sums.shape[2]
    for voxel in range(part * part_size, wp.min((part + 1) * part_size, voxels)):
        light, even, drawn = _known_at(sums, voxel)
        for channel in range(3):
            if even[channel] > wp.float64(0.0):
                total = wp.max(totals[3 + channel], wp.float64(1e-12))
                light_there = light[channel] - totals[channel] / total * even[channel]
                drawn_there = drawn[channel] - totals[6 + channel] / total * even[channel]
                # A voxel's weight is proportional to its paths, not to their square.
                share = wp.float64(1.0) / wp.max(even[channel], wp.float64(1e-12))
                product += share * light_there * drawn_there
                square += share * drawn_there * drawn_there
    out_parts[part, 0] = product
    out_parts[part, 1] = square


@wp.kernel
def _keep(
    ratios: wp.array4d[wp.float64],
    products: wp.array[wp.float64],
    origin: wp.vec3i,
    out_shares: wp.array3d[wp.vec4],
    first: int,
):
    """Write the shares of a voxel, or of the nearest voxel with ratios.

    origin: the first voxel with ratios, along Z, Y, X.
    """
    voxel = first + wp.tid()
    column = voxel % out_shares.shape[2]
    row = voxel / out_shares.shape[2] % out_shares.shape[1]
    layer = voxel / (out_shares.shape[2] * out_shares.shape[1])
    x = wp.clamp(column - origin[2], 0, ratios.shape[2] - 1)
    y = wp.clamp(row - origin[1], 0, ratios.shape[1] - 1)
    z = wp.clamp(layer - origin[0], 0, ratios.shape[0] - 1)
    most = wp.clamp(products[0] / wp.max(products[1], wp.float64(1e-30)), wp.float64(0.0), wp.float64(1.0))
    light = _rgb_at(ratios, z, y, x, 0)
    drawn = _rgb_at(ratios, z, y, x, 3)
    kept = most
    for channel in range(3):
        kept = wp.min(kept, light[channel] / wp.max(drawn[channel], wp.float64(1e-12)))
    kept = wp.max(kept, wp.float64(0.0))
    light -= kept * drawn
    out_shares[layer, row, column] = wp.vec4(float(light[0]), float(light[1]), float(light[2]), float(kept))


def prior_of(path_count: float) -> float:
    """Return the weight of larger voxels, in paths, for a mean number of paths per voxel. It falls as paths are added,
    because larger voxels let light leak past edges.
    """
    return min(max(_FALL / max(path_count, 1.0), _LEAST_PRIOR), MOST_PRIOR)


def shares(
    sums: wp.array4d[wp.float64],
    path_count: int,
    origin: tuple[int, int, int] = (0, 0, 0),
    prior: float = MOST_PRIOR,
) -> np.ndarray:
    """Return shares of light (Z, Y, X, 4) float32 from sums (Z, Y, X, 12) of `gather` over some paths.

    The shares are RGB relative to the light in uniform light, and the fraction of the drawn light to keep; both
    together are the light of the paths. Drawn light distinguishes strands and places within a voxel. The fraction is
    the best fit to the light of the paths, limited so that the kept light exceeds their light in no channel. origin,
    prior: as for `smooth_ratios`.
    """
    require_count("sums", sums.shape[3], CHANNELS)
    with wp.ScopedDevice(sums.device):
        found = wp.empty(sums.shape[:3], dtype=wp.vec4)
        ratios, low = smooth_box(sums, path_count, origin, prior)
        high = [start + side for start, side in zip(low, ratios.shape, strict=False)]
        inner = sums[tuple(slice(start, end) for start, end in zip(low, high, strict=True))]
        _by_voxels(_keep, found, [ratios, _explained(inner), wp.vec3i(*low), found])
        return found.numpy()


def smooth_box(
    sums: wp.array4d[wp.float64],
    path_count: int,
    origin: tuple[int, int, int] = (0, 0, 0),
    prior: float = MOST_PRIOR,
) -> tuple[wp.array4d[wp.float64], tuple[int, int, int]]:
    """Return (`smooth_ratios` of the voxels around all data, on the device; first of these voxels along Z, Y, X)."""
    with wp.ScopedDevice(sums.device):
        box = _box_of(sums)
        low = tuple(part.start for part in box)
        first = tuple(one + before for one, before in zip(origin, low[::-1], strict=True))
        return _smooth(sums[box], path_count, first, prior), low


def explained_part(sums: wp.array4d[wp.float64]) -> float:
    """Return the fraction of drawn light, from 0 to 1, that fits the light of the paths best (least squares over all
    voxels of (Z, Y, X, 12) sums), together with any amount of uniform light in each channel.
    """
    with wp.ScopedDevice(sums.device):
        product, square = _explained(sums).numpy().tolist()
    return min(max(product / max(square, 1e-30), 0.0), 1.0)


def smooth_ratios(
    sums: wp.array4d[wp.float64],
    path_count: int,
    origin: tuple[int, int, int] = (0, 0, 0),
    prior: float = MOST_PRIOR,
) -> np.ndarray:
    """Return ratios (Z, Y, X, 3 N) of light RGB to uniform light RGB, from sums (Z, Y, X, 6 N) over some paths,
    which have both N times.

    From large to small voxels, each ratio is blended with the ratio of the enclosing larger voxel, which has the weight
    of `prior` average paths. origin: index of the first voxel along X, Y, Z: voxels with an even index share a larger
    voxel with the next. Black without any light.
    """
    with wp.ScopedDevice(sums.device):
        return _smooth(sums, path_count, origin, prior).numpy()


def _smooth(sums, path_count, origin, prior):
    """Return `smooth_ratios` as an array on the device."""
    levels, shifts, first = [sums], [], np.array(origin[::-1])
    while max(levels[-1].shape[:3]) > 1:
        # Two voxels on both sides of the world's origin would never merge.
        sides = np.array(levels[-1].shape[:3])
        shift = np.where(sides > 2, first % 2, 0)
        first = first // 2
        halved = wp.empty((*((sides + shift + 1) // 2).tolist(), sums.shape[3]), dtype=wp.float64)
        shifts.append(wp.vec3i(*shift.tolist()))
        _by_voxels(_halve, halved, [levels[-1], shifts[-1], halved])
        levels.append(halved)
    total, channels = levels[-1], sums.shape[3] // 2
    ratios = wp.empty((1, 1, 1, channels), dtype=wp.float64)
    kernel_cache.launch(_divide, channels, [total], [ratios], sums.device)
    weight = wp.float64(prior / max(path_count, 1))
    for level, shift in zip(levels[-2::-1], reversed(shifts), strict=True):
        finer = wp.empty((*level.shape[:3], channels), dtype=wp.float64)
        _by_voxels(_refine, finer, [level, shift, total, weight, ratios, finer])
        ratios = finer
    return ratios


def _explained(sums):
    """Return (2,) numbers on the device whose quotient is `explained_part`."""
    count = sums.shape[0] * sums.shape[1] * sums.shape[2]
    size = -(-count // _MOST_PARTS)
    parts = -(-count // size)
    rows, totals = wp.empty((parts, 9), dtype=wp.float64), wp.empty(9, dtype=wp.float64)
    kernel_cache.launch(_add_known, parts, [sums, size], [rows], sums.device)
    kernel_cache.launch(_add_parts, 9, [rows], [totals], sums.device)
    products, found = wp.empty((parts, 2), dtype=wp.float64), wp.empty(2, dtype=wp.float64)
    kernel_cache.launch(_add_products, parts, [sums, totals, size], [products], sums.device)
    kernel_cache.launch(_add_parts, 2, [products], [found], sums.device)
    return found


def _by_voxels(kernel, voxels, inputs):
    """Run a kernel for each voxel of (Z, Y, X, ...)."""
    count = voxels.shape[0] * voxels.shape[1] * voxels.shape[2]
    parts = parallel.part_count(count, voxels.device, _LEAST_VOXELS)
    parallel.launch_shares(kernel, count, inputs, [[] for _ in range(parts)], voxels.device)


def _box_of(sums):
    """Return slices along Z, Y, X around all voxels of (Z, Y, X, C) sums with data.

    The whole range if there is none. One hair system may occupy a small part of the grid.
    """
    used = [wp.zeros(side, dtype=wp.uint8) for side in sums.shape[:3]]
    _by_voxels(_mark, sums, [sums, *used])
    box = []
    for marks in used:
        (at,) = np.nonzero(marks.numpy())
        box.append(slice(int(at[0]), int(at[-1]) + 1) if len(at) else slice(0, len(marks)))
    return tuple(box)
