# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner's angles about a fiber [Marschner03], from directions and back.

The tangent points from root to tip, `to_light` and `to_view` away from the fiber; all three are unit vectors (..., 3).
An inclination theta is measured from the normal plane, positive toward the tip. The azimuth phi is the rotation about
the tangent from the light to the viewer: 0 on the side of the light, pi straight behind the fiber. Radians everywhere.
"""

from typing import NamedTuple

import numpy as np

Values = float | np.ndarray  # (...): one number, or an array of any shape


class FibreAngles(NamedTuple):
    """Arrays of one shape (...), radians."""

    theta_i: np.ndarray  # inclination of the light, [-pi/2, pi/2]
    theta_o: np.ndarray  # inclination of the viewer, [-pi/2, pi/2]
    phi: np.ndarray  # relative azimuth, (-pi, pi]

    @property
    def theta_h(self) -> np.ndarray:
        """Half angle: zero on the mirror cone."""
        return 0.5 * (self.theta_o + self.theta_i)

    @property
    def theta_d(self) -> np.ndarray:
        """Difference angle: the inclination at which azimuthal scattering is computed."""
        return 0.5 * (self.theta_o - self.theta_i)


def fibre_angles(tangent: np.ndarray, to_light: np.ndarray, to_view: np.ndarray) -> FibreAngles:
    """Return the `FibreAngles` (...) of unit vectors (..., 3)."""
    theta_i = inclination(np.sum(tangent * to_light, axis=-1))
    theta_o = inclination(np.sum(tangent * to_view, axis=-1))
    return FibreAngles(theta_i, theta_o, relative_azimuth(tangent, to_light, to_view))


def relative_azimuth(tangent: np.ndarray, to_light: np.ndarray, to_view: np.ndarray) -> np.ndarray:
    """Return phi (...) in (-pi, pi], and 0 for a direction along the tangent, which has no azimuth.

    Scattering is even in phi, so the shader computes |phi|.
    """
    light = to_light - np.sum(tangent * to_light, axis=-1)[..., None] * tangent
    view = to_view - np.sum(tangent * to_view, axis=-1)[..., None] * tangent
    # The arc tangent is precise at phi = 0 and pi, where an arc cosine of the dot product loses half the digits.
    return np.arctan2(np.sum(tangent * np.cross(light, view), axis=-1), np.sum(light * view, axis=-1))


def inclination(sin_theta: Values) -> np.ndarray:
    """Return theta (...) from the dot product with the tangent (...); values beyond ±1 by rounding are clamped."""
    return np.arcsin(np.clip(sin_theta, -1.0, 1.0))


def direction(tangent: np.ndarray, normal: np.ndarray, theta: Values, phi: Values) -> np.ndarray:
    """Return unit vectors (..., 3) with inclinations and azimuths (...); phi is counted from `normal` about `tangent`.

    `normal` (..., 3) is a unit vector perpendicular to `tangent` (..., 3).
    """
    theta = np.asarray(theta)[..., None]
    phi = np.asarray(phi)[..., None]
    binormal = np.cross(tangent, normal)
    return np.sin(theta) * tangent + np.cos(theta) * (np.cos(phi) * normal + np.sin(phi) * binormal)


def cos_theta_d(sin_theta_i: Values, sin_theta_o: Values) -> np.ndarray:
    """Return cos((theta_o - theta_i) / 2) from the two dot products, exact by the half-angle formula; in [0, 1]."""
    cosines = sin_from_cos(sin_theta_i) * sin_from_cos(sin_theta_o)
    return np.sqrt(np.maximum(0.0, 0.5 * (1.0 + cosines + sin_theta_i * sin_theta_o)))


def sin_from_cos(cosine: Values) -> np.ndarray:
    """Return the sine of an angle in [0, pi], or the cosine of an inclination from its sine; rounding may exceed ±1."""
    return np.sqrt(np.maximum(0.0, 1.0 - np.square(cosine)))
