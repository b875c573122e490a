# SPDX-License-Identifier: GPL-3.0-or-later
"""A ray tracer of a smooth dielectric cylinder in three dimensions, as a reference for the shading tables.

It uses vectors, Snell's law and Fresnel's equations and shares no code with the package: no effective index, no
exit-angle formula, no roots. Radius 1, the axis along z, unpolarised light averaged at every surface.
"""

from typing import NamedTuple

import numpy as np


class Traced(NamedTuple):
    """Exiting light for N rays and the paths R, TT, TRT (p = 0, 1, 2)."""

    phi: np.ndarray  # (3, N) azimuth between the exit and the way back to the light, [0, pi]
    light: np.ndarray  # (3, N, C) part of each ray's light
    dh: np.ndarray  # (N,) width of fiber that each ray represents; sums to 2


def trace(theta_d, eta, sigma_a, ray_count):
    """Trace rays inclined by theta_d to the normal plane; sigma_a (C,) per radius."""
    sigma_a = np.asarray(sigma_a, float)
    # Even steps of the angle of incidence: rays are dense at the rim, where light is bent the most.
    gamma = (np.arange(ray_count) + 0.5) / ray_count * np.pi - 0.5 * np.pi
    h = np.sin(gamma)
    dh = np.cos(gamma) * np.pi / ray_count
    position = np.stack([np.sqrt(1.0 - h * h), h, np.zeros_like(h)], axis=-1)
    incoming = np.broadcast_to([-np.cos(theta_d), 0.0, -np.sin(theta_d)], position.shape)
    normal = position * [1.0, 1.0, 0.0]

    reflectance = fresnel(-_dot(incoming, normal), eta)
    phi = [_azimuth(_reflect(incoming, normal))]
    light = [np.repeat(reflectance[:, None], len(sigma_a), axis=1)]

    direction = _refract(incoming, normal, eta)
    strength = np.repeat((1.0 - reflectance)[:, None], len(sigma_a), axis=1)
    for _ in range(2):  # TT leaves at the first inner wall hit, TRT at the second
        across = direction[:, :2]
        distance = -2.0 * _dot(position[:, :2], across) / _dot(across, across)  # to the cylinder's other wall
        position = position + distance[:, None] * direction
        strength = strength * np.exp(-sigma_a * distance[:, None])
        normal = -position * [1.0, 1.0, 0.0]  # towards the ray
        reflectance = fresnel(-_dot(direction, normal), 1.0 / eta)[:, None]
        phi.append(_azimuth(_refract(direction, normal, 1.0 / eta)))
        light.append(strength * (1.0 - reflectance))
        direction = _reflect(direction, normal)
        strength = strength * reflectance
    return Traced(np.stack(phi), np.stack(light), dh)


def fresnel(cos_incident, eta):
    """Return the mean reflectance of both polarizations; eta: index beyond the surface over index before it."""
    cos_beyond = np.sqrt(1.0 - (1.0 - cos_incident**2) / eta**2)
    s = (cos_incident - eta * cos_beyond) / (cos_incident + eta * cos_beyond)
    p = (cos_beyond - eta * cos_incident) / (cos_beyond + eta * cos_incident)
    return 0.5 * (s * s + p * p)


def cell_means(traced, cell_count):
    """Return N_R, N_TT, N_TRT (3, cell_count, C): light per radian of phi, averaged over even cells of [0, pi]."""
    means = np.empty((3, cell_count, traced.light.shape[-1]))
    for path in range(3):
        cell = np.minimum((traced.phi[path] / np.pi * cell_count).astype(int), cell_count - 1)
        for channel in range(means.shape[-1]):
            weights = 0.5 * traced.light[path, :, channel] * traced.dh
            means[path, :, channel] = np.bincount(cell, weights, cell_count)
    # Rays left and right of the axis leave left and right: a cell of |phi| holds the light of two cells.
    return 0.5 * means * cell_count / np.pi


def energies(traced):
    """Return ½ int A dh of R, TT, TRT, (3, C)."""
    return 0.5 * np.einsum("pnc,n->pc", traced.light, traced.dh)


def _dot(a, b):
    return np.sum(a * b, axis=-1)


def _reflect(direction, normal):
    return direction - 2.0 * _dot(direction, normal)[:, None] * normal


def _refract(direction, normal, eta):
    cos_incident = -_dot(direction, normal)
    cos_beyond = np.sqrt(1.0 - (1.0 - cos_incident**2) / eta**2)
    return direction / eta + (cos_incident / eta - cos_beyond)[:, None] * normal


def _azimuth(direction):
    """Return the angle in the xy plane from the light's side (+x), [0, pi]."""
    return np.abs(np.arctan2(direction[:, 1], direction[:, 0]))
