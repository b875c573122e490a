# SPDX-License-Identifier: GPL-3.0-or-later
"""Selection of lamps by importance: the most important are drawn individually, the others form an ambient cube.

A lamp is a record with the fields of `Light` in shaders/light/lights.glsl.
"""

import numpy as np

from . import ambient_cube

SUN, POINT, SPOT, AREA = range(4)  # kinds

_FADE = 0.25  # a lamp has full weight if its importance exceeds that of the first omitted lamp by this fraction


def directions_to(lamps: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return unit vectors (N, P, 3) from places (P, 3) to lamps (N,)."""
    offsets = lamps["position"][:, None, :3].astype(float) - places
    offsets /= np.maximum(np.linalg.norm(offsets, axis=-1, keepdims=True), 1e-12)
    suns = -lamps["axis"][:, None, :3].astype(float)
    return np.where(lamps["kind"][:, None, None] == SUN, suns, offsets)


def irradiance(lamps: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return irradiance (N, P, 3) [W/m²] of a small ball at places (P, 3) by lamps (N,), as in light/lights.glsl."""
    kind = lamps["kind"][:, None]
    offsets = places - lamps["position"][:, None, :3].astype(float)
    squared = np.maximum(np.sum(np.square(offsets), axis=-1), 1e-8)
    cos_angle = np.sum(lamps["axis"][:, None, :3] * offsets, axis=-1) / np.sqrt(squared)
    cos_cone, blend, radius = (lamps[name][:, None].astype(float) for name in ("cos_cone", "blend", "radius"))
    beam = _spot_falloff(cos_angle, cos_cone, blend)
    edge = np.sqrt(squared + np.square(radius))
    point = np.where(kind == SPOT, beam, 1.0) / (2.0 * np.pi * edge * (edge + np.sqrt(squared)))
    height = np.maximum(cos_angle, 0.0) * np.sqrt(squared)
    beside = np.sqrt(np.maximum(squared - np.square(height), 0.0))
    area = _disk_irradiance(height, beside, radius) * _area_falloff(cos_angle, cos_cone) / np.pi
    part = np.where(kind == SUN, 1.0, np.where(kind == AREA, area, point))
    return part[..., None] * lamps["power"][:, None, :3]


def _disk_irradiance(height, beside, radius):
    """Return the irradiance of a small ball by a Lambertian disk of 1 W/sr along its axis, as in light/lights.glsl."""
    outside = height**2 + beside**2 - radius**2
    root = np.maximum(np.sqrt(outside**2 + 4.0 * height**2 * radius**2), 1e-12)
    far = 2.0 * height**2 / (root * np.maximum(root + outside, 1e-12))
    near = (root - outside) / (2.0 * root * np.maximum(radius, 1e-6) ** 2)
    edges = np.stack([np.maximum(beside - radius, 0.0), beside + radius])
    cosine = (height / np.sqrt(np.maximum(height**2 + edges**2, 1e-12))).mean(axis=0)
    return np.where(height > 0.0, np.where(outside > 0.0, far, near) / np.maximum(cosine, 1e-12), 0.0)


def _spot_falloff(cos_angle, cos_cone, blend):
    inner = cos_cone + (1.0 - cos_cone) * np.clip(blend, 1e-4, 1.0)
    return _smooth((cos_angle - cos_cone) / np.maximum(inner - cos_cone, 1e-12))


def _area_falloff(cos_angle, cos_cone):
    cos_cone = np.where(cos_cone < 1e-3, 1e-3, cos_cone)
    tan_cone = np.sqrt(1.0 - cos_cone**2) / cos_cone
    tan_angle = np.sqrt(np.maximum(1.0 - cos_angle**2, 0.0)) / np.maximum(cos_angle, 1e-6)
    beam = np.maximum(0.0, tan_cone - tan_angle) / np.maximum(tan_cone - np.arctan(tan_cone), 1e-12)
    return np.where(cos_cone <= 1e-3, 1.0, beam)


def _smooth(values):
    part = np.clip(values, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def shares(importance: np.ndarray, count: int) -> np.ndarray:
    """Return the fractions (N,) in [0, 1] of lamps' light that are drawn individually, positive for at most `count`.

    Fractions are continuous in the importance (N,): a lamp has faded out before another lamp replaces it.
    """
    if len(importance) <= count:
        return np.ones(len(importance))
    least = np.partition(importance, len(importance) - count - 1)[len(importance) - count - 1]
    return np.where(importance > least, _smooth((importance / max(least, 1e-30) - 1.0) / _FADE), 0.0)


def ambient_sides(lamps: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the mean radiance (6, 3) of an ambient cube's sides for lamps (N,), averaged over places (P, 3).

    Averaged over orientations, a plane receives E / 4 from a lamp of irradiance E, and π/6 of the sum of the sides'
    radiance from an ambient cube: the sides sum to 3 E / (2 π).
    """
    sides = ambient_cube.side_shares(directions_to(lamps, places))
    return 1.5 / np.pi * np.einsum("nps,npc->sc", sides, irradiance(lamps, places)) / len(places)
