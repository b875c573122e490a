# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic fibers: the internal reflection of a circular fiber with an effective index that depends on the azimuth
[Marschner03].

A circle with the index eta* bends light like the ellipse, for light and viewer at the mean azimuth phi_h from the major
axis. The index goes from eta*_1 along the major axis to eta*_2 across it, linearly in cos(2 phi_h).
"""

import numpy as np

from .angles import Values

LAYER_COUNT = 4  # number of baked indices, from eta*_1 to eta*_2


def layer_etas(eta: float, eccentricity: float) -> np.ndarray:
    """Return eta* of each layer, (4,); eccentricity: ratio of the minor to the major axis."""
    squared = eccentricity**2
    low, high = (2.0 * (eta - 1.0) * ratio - eta + 2.0 for ratio in (squared, 1.0 / squared))
    return np.linspace(low, high, LAYER_COUNT)


def layer_weights(cosine: np.ndarray) -> np.ndarray:
    """Return the weight of each layer, (..., 4), at cos(2 phi_h) (...)."""
    place = 0.5 * (LAYER_COUNT - 1) * (1.0 - np.asarray(cosine)[..., None])
    return np.maximum(0.0, 1.0 - np.abs(place - np.arange(LAYER_COUNT)))


def major_axis(tangent: np.ndarray, random: Values) -> np.ndarray:
    """Return the unit vector (..., 3) of the section's major axis: a random direction per strand, perpendicular to its
    tangent (..., 3).

    The axis rotates with the fiber, with a seam only where a strand runs along the random direction.
    """
    z, turn = 2.0 * random - 1.0, 2.0 * np.pi * ((random * 1021.0) % 1.0)
    radius = np.sqrt(1.0 - z * z)
    own = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)
    across = own - np.sum(own * tangent, axis=-1, keepdims=True) * tangent
    return across / np.linalg.norm(across, axis=-1, keepdims=True)


def cos_twice_phi_h(tangent: np.ndarray, axis: np.ndarray, to_light: np.ndarray, to_view: np.ndarray) -> np.ndarray:
    """Return cos(2 phi_h) = cos(phi_i + phi_o), (...), of azimuths measured from the major axis."""
    other = np.cross(tangent, axis)
    light, view = ([np.sum(direction * base, axis=-1) for base in (axis, other)] for direction in (to_light, to_view))
    return (light[0] * view[0] - light[1] * view[1]) / (np.hypot(*light) * np.hypot(*view))
