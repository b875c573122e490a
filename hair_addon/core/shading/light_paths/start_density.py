# SPDX-License-Identifier: GPL-3.0-or-later
"""Density of the starts of paths: more paths start where the drawn light is bright.

Light that strands reflect from a lamp behind them is hundreds of times as bright as the mean and varies as much from
path to path: without this, 0.1 % of the paths have three quarters of the variance. Paths have the reciprocal of their
density as weight, so all means stay the same. Where the light of paths varies for other reasons, density is even.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ...kernels.checks import require_count
from .voxel_means import CHANNELS

wp.set_module_options({"enable_backward": False})

EVEN = wp.constant(33)  # level of the mean density; level 0: no starts
_LEVEL = wp.constant(float(np.log(2.0)) / 4.0)  # log of the factor between two levels
_LEVELS_OF_TWO = 4  # levels between a density and twice the density
WORTH = 0.5  # mean square of paths' light, relative to that with even density, above which density is even
_LEAST, _MOST = 0.5, 32.0  # relative to the mean
_SIDE = wp.constant(4)  # voxels along the blocks whose light is compared
_PRIOR = 0.0003  # weight of the mean light in each block, as a fraction of all light in uniform light


@wp.func
def density_of(level: int):
    """Return the density of a level, relative to the mean."""
    return wp.exp(float(level - EVEN) * _LEVEL)


@wp.func
def level_at(levels: wp.array3d[wp.uint8], corner: wp.vec3, voxel: float, start: wp.vec3, end: wp.vec3, most: int):
    """Return the greatest level of the voxels that contain a segment, of which `most` places are looked up."""
    places = 2 + wp.clamp(int(2.0 * wp.length(end - start) / voxel), 0, most)
    found = int(0)
    for step in range(places):
        place = start + (end - start) * (float(step) / float(places - 1))
        at = (place - corner) / voxel
        x = wp.clamp(int(at[0]), 0, levels.shape[2] - 1)
        y = wp.clamp(int(at[1]), 0, levels.shape[1] - 1)
        z = wp.clamp(int(at[2]), 0, levels.shape[0] - 1)
        found = wp.max(found, int(levels[z, y, x]))
    return found


@wp.kernel
def _add_blocks(sums: wp.array4d[wp.float64], out_light: wp.array3d[wp.float64], out_even: wp.array3d[wp.float64]):
    """Add the drawn light, and the light in uniform light, of the voxels of each block."""
    z, y, x = wp.tid()
    light = wp.float64(0.0)
    even = wp.float64(0.0)
    for layer in range(_SIDE * z, wp.min(_SIDE * (z + 1), sums.shape[0])):
        for row in range(_SIDE * y, wp.min(_SIDE * (y + 1), sums.shape[1])):
            for column in range(_SIDE * x, wp.min(_SIDE * (x + 1), sums.shape[2])):
                for channel in range(6, 9):
                    light += sums[layer, row, column, channel]
                    even += sums[layer, row, column, channel + 3]
    out_light[z, y, x] += light
    out_even[z, y, x] += even


@wp.kernel
def _level(blocks: wp.array3d[wp.uint8], levels: wp.array3d[wp.uint8]):
    """Replace the levels of voxels with starts by those of their blocks."""
    z, y, x = wp.tid()
    if levels[z, y, x] > wp.uint8(0):
        levels[z, y, x] = blocks[z / _SIDE, y / _SIDE, x / _SIDE]


def set_levels(levels: wp.array3d[wp.uint8], sums: Sequence[wp.array4d[wp.float64]]) -> None:
    """Set the levels of all voxels with starts from the `CHANNELS` sums (Z, Y, X, C) of each different hair.

    The density is proportional to the drawn light relative to the light in uniform light, within limits, and its mean
    over the visible hair is one.
    """
    for of_hair in sums:
        for side, wanted in zip(of_hair.shape[:3], levels.shape, strict=True):
            require_count("voxels", side, wanted)
        require_count("channels", of_hair.shape[3], CHANNELS)
    blocks = tuple(-(-side // int(_SIDE)) for side in levels.shape)
    light, even = (wp.zeros(blocks, dtype=wp.float64, device=levels.device) for _ in range(2))
    for of_hair in sums:
        kernel_cache.launch(_add_blocks, blocks, [of_hair], [light, even], levels.device)
    chosen = wp.array(_levels_of(light.numpy(), even.numpy()), dtype=wp.uint8, device=levels.device)
    kernel_cache.launch(_level, levels.shape, [chosen], [levels], levels.device)


@wp.kernel
def _even(levels: wp.array3d[wp.uint8]):
    z, y, x = wp.tid()
    if levels[z, y, x] > wp.uint8(0):
        levels[z, y, x] = wp.uint8(EVEN)


def set_even(levels: wp.array3d[wp.uint8]) -> None:
    """Set even density in all voxels with starts."""
    kernel_cache.launch(_even, levels.shape, [levels], [], levels.device)


def _levels_of(light, even):
    """Return the uint8 levels of blocks with sums of drawn light and of light in uniform light."""
    mean, prior = light.sum() / max(even.sum(), 1e-30), _PRIOR * even.sum()
    if not (np.isfinite(mean) and mean > 0.0 and prior > 0.0):
        return np.full(light.shape, int(EVEN), np.uint8)
    density = np.clip((light / mean + prior) / (even + prior), _LEAST, _MOST)
    density /= (density * even).sum() / even.sum()
    return np.rint(int(EVEN) + _LEVELS_OF_TWO * np.log2(density)).astype(np.uint8)
