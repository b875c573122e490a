# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo of rough surfaces: the microfacets of [Walter07] and [Heitz14]."""

from functools import cache

import numpy as np

SIZE = 32
_SAMPLE_COUNT = 512  # of microfacets' normals, for each texel
_REFRACTIVE_INDEX = 1.5  # of the dielectric whose Fresnel reflectance is scaled to other dielectrics


@cache
def table() -> np.ndarray:
    """Return (SIZE, SIZE, 4) float32: the albedo of microfacets, for any Fresnel reflectance F0 at normal incidence.

    Rows run over the roughness, columns over the cosine of the eye's angle, both from 0 to 1. Channels: the albedo e of
    perfect mirrors; b of metals and of dielectrics, which reflect (e - b) F0 + b; the mean of e over cosines.
    """
    roughness = np.maximum(np.linspace(0.0, 1.0, SIZE), 0.02)[:, None, None]
    n_dot_v = np.maximum(np.linspace(0.0, 1.0, SIZE), 1e-3)[None, :, None]
    v_dot_h, weights = _microfacets(roughness, n_dot_v)
    cosine = np.clip(v_dot_h, 0.0, 1.0)
    straight = ((_REFRACTIVE_INDEX - 1.0) / (_REFRACTIVE_INDEX + 1.0)) ** 2
    dielectric = (_fresnel(cosine, _REFRACTIVE_INDEX) - straight) / (1.0 - straight)
    shares = [(weights * fresnel).mean(axis=-1) for fresnel in (1.0, (1.0 - cosine) ** 5, dielectric)]
    mean = 2.0 * np.trapezoid(shares[0] * n_dot_v[..., 0], n_dot_v[0, :, 0], axis=1)
    return np.stack([*shares, np.broadcast_to(mean[:, None], shares[0].shape)], axis=-1).astype(np.float32)


def _microfacets(roughness, n_dot_v):
    """Return V·H of normals sampled by their density [Walter07, Eq. 35], and light that each reflects as a mirror."""
    index = np.arange(_SAMPLE_COUNT)
    share, azimuth = (index + 0.5) / _SAMPLE_COUNT, 2.0 * np.pi * np.modf(0.61803399 * index)[0]
    squared = roughness**4
    n_dot_h = np.sqrt((1.0 - share) / (1.0 + (squared - 1.0) * share))
    v_dot_h = n_dot_h * n_dot_v + np.sqrt((1.0 - n_dot_h**2) * (1.0 - n_dot_v**2)) * np.cos(azimuth)
    n_dot_l = 2.0 * v_dot_h * n_dot_h - n_dot_v
    is_seen = (n_dot_l > 0.0) & (v_dot_h > 0.0)
    n_dot_l = np.where(is_seen, n_dot_l, 1.0)
    to_eye = n_dot_l * np.sqrt(n_dot_v**2 * (1.0 - squared) + squared)
    to_light = n_dot_v * np.sqrt(n_dot_l**2 * (1.0 - squared) + squared)
    return v_dot_h, np.where(is_seen, 2.0 * v_dot_h * n_dot_l / (n_dot_h * (to_eye + to_light)), 0.0)


def _fresnel(cosine, refractive_index):
    """Return the reflectance of a dielectric for unpolarized light."""
    g = np.sqrt(refractive_index**2 - 1.0 + cosine**2)
    along = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0)
    return 0.5 * ((g - cosine) / (g + cosine)) ** 2 * (1.0 + along**2)
