# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as a light source of paths: an equirectangular picture whose texels are sampled by their light.

Paths that hit the sky sample the world too; both samples are weighted by their share of the densities [Veach95], so
that small bright places, such as windows and suns, cause no noise. A nearly uniform picture is not sampled by light.
"""

import numpy as np
import warp as wp

from .fibre_walk import PI

wp.set_module_options({"enable_backward": False, "fast_math": True})

_UNEVEN = 4.0  # ratio of the brightest to the mean radiance from which directions are sampled by light


@wp.struct
class World:
    """A picture's texels (H, W): rows of latitude from the lowest, columns from pi to -pi.

    density: [1/sr] with which directions in a texel are sampled; rows: (H,) and columns: (H, W), cumulative
    probabilities of rows and of texels in a row; is_uneven: whether directions are sampled by light.
    """

    radiance: wp.array2d[wp.vec3]
    density: wp.array2d[float]
    rows: wp.array[float]
    columns: wp.array2d[float]
    is_uneven: int


def world_of(picture: np.ndarray) -> World:
    """Return the `World` of a picture (H, W, 3) of radiance, on Warp's current device."""
    picture = np.maximum(np.asarray(picture, np.float64), 0.0)
    height, width = picture.shape[:2]
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    solid_angles = np.diff(edges)[:, None] * (2.0 * np.pi / width)
    power = (picture[..., 0] + picture[..., 1] + picture[..., 2]) * solid_angles  # NumPy is slow along short axes
    chances = power / max(power.sum(), 1e-30)
    rows = chances.sum(axis=1)
    columns = np.cumsum(chances, axis=1) / np.maximum(rows, 1e-30)[:, None]
    density = chances / solid_angles
    world = World()
    world.radiance = wp.array(picture.astype(np.float32), dtype=wp.vec3)
    world.density = wp.array(density.astype(np.float32), dtype=float)
    world.rows = wp.array(np.cumsum(rows).astype(np.float32), dtype=float)
    world.columns = wp.array(columns.astype(np.float32), dtype=float)
    world.is_uneven = int(density.max() * 4.0 * np.pi > _UNEVEN)
    return world


@wp.func
def _texel(world: World, direction: wp.vec3):
    """(row, column) of a direction."""
    height = world.radiance.shape[0]
    width = world.radiance.shape[1]
    u = 0.5 - wp.atan2(direction[1], direction[0]) / (2.0 * PI)
    v = 0.5 + wp.asin(wp.clamp(direction[2], -1.0, 1.0)) / PI
    row = wp.clamp(int(v * float(height)), 0, height - 1)
    return row, wp.clamp(int(u * float(width)), 0, width - 1)


@wp.func
def world_radiance(world: World, direction: wp.vec3):
    """Radiance of the world from a direction."""
    row, column = _texel(world, direction)
    return world.radiance[row, column]


@wp.func
def world_density(world: World, direction: wp.vec3):
    """Return the density [1/sr] with which `world_direction` samples a direction."""
    row, column = _texel(world, direction)
    return world.density[row, column]


@wp.func
def _row_by(world: World, chance: float):
    """Return the first row whose cumulative probability exceeds a random number."""
    low = int(0)
    high = world.rows.shape[0] - 1
    while low < high:
        middle = (low + high) / 2
        if world.rows[middle] > chance:
            high = middle
        else:
            low = middle + 1
    return low


@wp.func
def _column_by(world: World, row: int, chance: float):
    """Return the first texel of a row whose cumulative probability exceeds a random number."""
    low = int(0)
    high = world.columns.shape[1] - 1
    while low < high:
        middle = (low + high) / 2
        if world.columns[row, middle] > chance:
            high = middle
        else:
            low = middle + 1
    return low


@wp.func
def world_direction(world: World, random: wp.uint32):
    """Sample a direction by the light of the picture; returns (direction, radiance, density [1/sr], random state)."""
    state = random
    row = _row_by(world, wp.randf(state))
    column = _column_by(world, row, wp.randf(state))
    height = float(world.radiance.shape[0])
    low = wp.sin(PI * (float(row) / height - 0.5))
    high = wp.sin(PI * (float(row + 1) / height - 0.5))
    z = low + (high - low) * wp.randf(state)
    azimuth = PI - 2.0 * PI * (float(column) + wp.randf(state)) / float(world.radiance.shape[1])
    across = wp.sqrt(wp.max(0.0, 1.0 - z * z))
    direction = wp.vec3(across * wp.cos(azimuth), across * wp.sin(azimuth), z)
    return direction, world.radiance[row, column], world.density[row, column], state
