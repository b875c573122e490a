# SPDX-License-Identifier: GPL-3.0-or-later
"""The kernels for GPUs, run by Warp on the processor, give the tables of NumPy."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.fibre.azimuthal import roughening
from hair_addon.core.shading.fibre.principled import scale_from_radial_roughness
from hair_addon.core.shading.tables import lookup_tables, texel_kernels


@pytest.mark.parametrize(
    "details",
    [
        {},
        {"caustic": "exact", "axes": "COSINES"},
        {"eta": 1.2, "glint_width": 0.05, "sigma_a": (0.0, 1.0, 1000.0)},
        {"mode": "energy", "coat": 0.3, "tilt": 0.1},
        {"mode": "energy", "radial_roughness": 0.05, "roughness": 0.05, "axes": "COSINES"},
    ],
    ids=str,
)
def test_kernels_give_the_same_texels_to_single_precision(details, device):
    settings = lookup_tables.Settings(size=48, **details)
    expected = lookup_tables.bake(settings)
    edges, cosines = lookup_tables.phi_edges(settings), lookup_tables.row_cosines(settings)
    spread = None
    if settings.mode == "energy":
        spread = roughening(edges, scale_from_radial_roughness(settings.radial_roughness)).astype(np.float32)
    n_r, n_tt, n_trt = texel_kernels.azimuthal_means(edges, cosines, settings, settings.sigma_a, spread, device)
    np.testing.assert_allclose(np.concatenate([n_tt, n_r], axis=-1), expected.n, rtol=2e-6, atol=1e-9)
    np.testing.assert_allclose(n_trt, expected.n_trt, rtol=2e-6, atol=1e-9)

    theta = np.arcsin(2.0 * cosines - 1.0) if settings.axes == "COSINES" else np.pi * (cosines - 0.5)
    np.testing.assert_allclose(
        texel_kernels.longitudinal_texels(theta, settings, device), expected.m, rtol=2e-6, atol=1e-30
    )


@pytest.mark.parametrize("mode", ["classic", "energy"])
def test_all_texels_are_launched_at_once(mode, monkeypatch):
    settings, launches = lookup_tables.Settings(mode=mode), []
    launch = wp.launch
    monkeypatch.setattr(wp, "launch", lambda *args, **kwargs: (launches.append(args), launch(*args, **kwargs)))
    edges, cosines = lookup_tables.phi_edges(settings), lookup_tables.row_cosines(settings)
    spread = np.eye(settings.size, dtype=np.float32) if mode == "energy" else None
    texel_kernels.azimuthal_means(edges, cosines, settings, settings.sigma_a, spread, "cpu")
    assert len(launches) == (1 if mode == "classic" else 4)
