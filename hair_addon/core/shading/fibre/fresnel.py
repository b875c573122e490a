# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel reflectance of a dielectric, and the effective indices in the fiber's normal plane."""

import numpy as np

from .angles import Values


def dielectric_reflectance(cos_incident: Values, eta: Values) -> np.ndarray:
    """Return the Fresnel reflectance for unpolarized light from outside; 1 for total reflection.

    cos_incident (...): cosine between ray and surface normal, [0, 1]; eta: index inside over index outside.
    """
    sin_refracted_squared = (1.0 - np.square(cos_incident)) / np.square(eta)
    cos_refracted = np.sqrt(np.maximum(0.0, 1.0 - sin_refracted_squared))
    perpendicular = (cos_incident - eta * cos_refracted) / (cos_incident + eta * cos_refracted)
    parallel = (eta * cos_incident - cos_refracted) / (eta * cos_incident + cos_refracted)
    reflectance = 0.5 * (np.square(perpendicular) + np.square(parallel))
    return np.where(sin_refracted_squared >= 1.0, 1.0, reflectance)


def bravais_indices(cos_theta_d: Values, eta: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return (eta', eta''): effective indices in the normal plane for a ray inclined by theta_d [Marschner03].

    eta' determines refraction and the reflectance of perpendicular polarization, eta'' = eta^2 / eta' the reflectance
    of parallel polarization. cos_theta_d (...) in (0, 1].
    """
    root = np.sqrt(np.square(eta) - 1.0 + np.square(cos_theta_d))  # sqrt(eta^2 - sin^2 theta_d)
    return root / cos_theta_d, np.square(eta) * cos_theta_d / root


def bravais_reflectance(
    cos_gamma_i: Values, cos_gamma_t: Values, eta_prime: Values, eta_double_prime: Values
) -> np.ndarray:
    """Return F(eta', eta'', gamma_i) of Eq. 17, which equals `dielectric_reflectance(cos_theta_d * cos_gamma_i, eta)`.

    gamma_t follows from eta' for both polarizations. Public code refracts a second ray by eta'', which is totally
    reflected if eta'' < 1 (theta_d > 57 degrees for hair), although a ray that enters a denser medium is never totally
    reflected.
    """
    perpendicular = (cos_gamma_i - eta_prime * cos_gamma_t) / (cos_gamma_i + eta_prime * cos_gamma_t)
    parallel = (eta_double_prime * cos_gamma_i - cos_gamma_t) / (eta_double_prime * cos_gamma_i + cos_gamma_t)
    return 0.5 * (np.square(perpendicular) + np.square(parallel))
