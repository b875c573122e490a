# SPDX-License-Identifier: GPL-3.0-or-later
"""Decomposition of environment light into a few bright lobes with shadows and highlights, and an ambient cube.

An environment image (H, W, 3) has the azimuth in its columns, u = (k + 0.5) / W, from pi to -pi, and the elevation in
its rows, v = (j + 0.5) / H, from -pi/2 to pi/2; x is at azimuth 0, z at the top.
"""

from dataclasses import dataclass, replace

import numpy as np

from . import ambient_cube

_LOBE_LIMIT = 4
_LEAST_PART = 0.08  # least fraction of all light in a lobe: dimmer lobes remain in the ambient cube
_WINDOW, _RING = np.cos(np.radians([30.0, 45.0]))  # maximum radius of a lobe, and outer radius of its background ring
_SHARPNESS = 20.0  # sharpness of the kernel that finds the brightest point
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Lobe:
    """A bright part of the environment. direction: unit vector toward the lobe.

    irradiance: (3,) of a small ball [W/m²]; variance: of the light about the direction, along each of two axes [rad²].
    A plane that faces the lobe receives the fraction 1 - variance.
    """

    direction: np.ndarray
    irradiance: np.ndarray
    variance: float


def split(radiance: np.ndarray) -> tuple[list[Lobe], np.ndarray]:
    """Return ([`Lobe`, ...], (6, 3) mean radiance of the cube's sides without the lobes) of an environment image."""
    lobes, left = decompose(radiance)
    return lobes, _side_means(left, np.eye(3))


def turned(lobes: list[Lobe], left: np.ndarray, to_image: np.ndarray) -> tuple[list[Lobe], np.ndarray]:
    """Return the result of `split` for a turned image; lobes, left: from `decompose`.

    to_image: (3, 3), from world directions to directions of the image.
    """
    return [replace(lobe, direction=to_image.T @ lobe.direction) for lobe in lobes], _side_means(left, to_image)


def _side_means(radiance, to_image):
    directions, solid_angles = _texels(*radiance.shape[:2])
    return ambient_cube.side_means(radiance.reshape(-1, 3), directions @ to_image, solid_angles / (4.0 * np.pi))


def decompose(radiance: np.ndarray) -> tuple[list[Lobe], np.ndarray]:
    """Return ([`Lobe`, ...], (H, W, 3) radiance without the lobes) of an environment image."""
    directions, solid_angles = _texels(*radiance.shape[:2])
    left = np.maximum(radiance.reshape(-1, 3), 0.0).astype(float)
    least = _LEAST_PART * float((left @ _LUMINANCE) @ solid_angles)
    lobes = []
    centres = _spread_out(400)
    nearness = np.exp(_SHARPNESS * (centres @ directions.T - 1.0))
    for _ in range(_LOBE_LIMIT):
        peak = centres[np.argmax(nearness @ ((left @ _LUMINANCE) * solid_angles))]
        window, excess = _excess_around(peak, left, directions)
        power = excess.T @ solid_angles[window]
        if not power @ _LUMINANCE > least:
            break
        moment = (excess @ _LUMINANCE * solid_angles[window]) @ directions[window]
        closeness = np.linalg.norm(moment) / (power @ _LUMINANCE)
        direction = moment / np.linalg.norm(moment)
        lobes.append(Lobe(direction, np.maximum(power, 0.0), 1.0 - float(closeness)))
        left[window] -= excess
    return lobes, left.reshape(radiance.shape)


def _excess_around(peak, radiance, directions):
    """Return indices (M,) of the texels around a point, and their radiance (M, 3) above the background."""
    cosines = directions @ peak
    ring = (cosines < _WINDOW) & (cosines > _RING)
    window = np.flatnonzero(cosines >= _WINDOW)
    return window, np.maximum(radiance[window] - np.median(radiance[ring], axis=0), 0.0)


def _texels(height, width):
    """Return unit directions (H W, 3) of an image's texels, and their solid angles (H W,)."""
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    theta = np.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    phi = np.pi * (1.0 - 2.0 * (np.arange(width) + 0.5) / width)[None]
    directions = np.stack(np.broadcast_arrays(np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)))
    solid_angles = np.repeat(np.diff(edges) * (2.0 * np.pi / width), width)
    return directions.reshape(3, -1).T, solid_angles


def _spread_out(count):
    """Return evenly distributed unit vectors (N, 3), on a spiral with the golden angle [Vogel79]."""
    heights = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turns = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - heights**2)
    return np.stack([across * np.cos(turns), across * np.sin(turns), heights], axis=-1)
