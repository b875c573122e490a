# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through the fiber conserve energy, and have a caustic and an inverse of the exit angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.shading.fibre import paths
from hair_addon.core.shading.fibre.fresnel import bravais_indices

ETA = 1.55


def test_only_the_later_bounces_are_missing():
    """Only later bounces are missing: without absorption R + TT + TRT = 1 - (1 - F) F², the series cut after three
    terms.
    """
    fresnel = np.linspace(0.0, 1.0, 11)
    r, tt, trt = paths.attenuation(fresnel, transmittance=1.0)
    np.testing.assert_allclose(r + tt + trt, 1.0 - (1.0 - fresnel) * fresnel**2, rtol=1e-14)


@given(st.floats(0.0, 0.98), st.floats(0.0, 1.0))
def test_the_residual_is_every_later_bounce(fresnel, transmittance):
    later = sum((1.0 - fresnel) ** 2 * fresnel ** (p - 1) * transmittance**p for p in range(3, 2000))
    assert paths.residual_attenuation(fresnel, transmittance) == pytest.approx(later, rel=1e-9, abs=1e-15)
    total = sum(paths.attenuation(fresnel, 1.0)) + paths.residual_attenuation(fresnel, 1.0)
    assert total == pytest.approx(1.0)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_no_ray_gains_light(fresnel, transmittance):
    lobes = paths.attenuation(fresnel, transmittance)
    assert min(lobes) >= 0.0
    assert sum(lobes) <= 1.0 + 1e-12


def test_light_through_the_axis_crosses_one_diameter():
    """Light through the axis crosses one diameter: Beer's law over two radii, half of the report's exponent."""
    found = paths.crossing_transmittance(np.array(0.0), np.array(1.0), ETA, (0.3, 1.0))
    np.testing.assert_allclose(found, np.exp([-0.6, -2.0]))


def test_inclined_light_crosses_a_longer_way():
    theta_t = np.arcsin(np.sin(1.2) / ETA)
    found = paths.crossing_transmittance(np.array(0.0), np.cos(np.array(1.2)), ETA, (1.0,))
    np.testing.assert_allclose(found, np.exp(-2.0 / np.cos(theta_t)))


@pytest.mark.parametrize(("degrees", "phi_c", "support"), [(0, 18.62, 19.29), (20, 14.33, 26.28), (40, 3.10, 48.41)])
def test_caustic_and_edge_of_trt_lie_where_published(degrees, phi_c, support):
    eta_prime, _ = bravais_indices(np.cos(np.radians(degrees)), ETA)
    at_caustic = paths.exit_angle(paths.TRT, paths.caustic_gamma(eta_prime), eta_prime)
    at_rim = paths.exit_angle(paths.TRT, 0.5 * np.pi, eta_prime)
    assert np.degrees(at_caustic) == pytest.approx(phi_c, abs=0.005)
    assert abs(np.degrees(at_rim)) == pytest.approx(support, abs=0.005)


@given(st.sampled_from([paths.R, paths.TT, paths.TRT]), st.floats(-1.5, 1.5), st.floats(1.05, 20.0))
def test_slope_is_the_derivative_of_the_exit_angle(p, gamma, eta_prime):
    step = 1e-6
    ends = paths.exit_angle(p, np.array([gamma - step, gamma + step]), eta_prime)
    assert paths.exit_angle_slope(p, gamma, eta_prime) == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-6)


@given(st.floats(0.0, np.pi / 2), st.floats(1.02, 50.0))
def test_tt_s_closed_form_inverts_the_exit_angle(gamma, eta_prime):
    phi = paths.exit_angle(paths.TT, gamma, eta_prime)
    assert paths.exit_angle(paths.TT, paths.tt_gamma(phi, eta_prime), eta_prime) == pytest.approx(phi, abs=1e-9)


@given(st.floats(-np.pi / 2, np.pi / 2), st.floats(1.02, 50.0))
def test_every_trt_ray_is_found_in_its_segment_and_in_no_other(gamma, eta_prime):
    phi = paths.exit_angle(paths.TRT, gamma, eta_prime)
    holders = [segment for segment in paths.trt_segments(np.array(eta_prime)) if segment[0] < gamma < segment[1]]
    assert len(holders) <= 1  # none where it is the very end of a segment
    for segment in holders:
        found = paths.trt_gamma(phi, *segment, eta_prime)
        assert paths.exit_angle(paths.TRT, found, eta_prime) == pytest.approx(phi, abs=1e-9)
        # In the middle of a flat exit angle many gamma leave at the same phi to rounding.
        slope = abs(paths.exit_angle_slope(paths.TRT, gamma, eta_prime))
        assert found == pytest.approx(gamma, abs=1e-10 / max(slope, 1e-6))


@given(st.floats(1.02, 50.0))
def test_segments_are_monotone_and_cover_the_fibre(eta_prime):
    covered = 0.0
    for low, high, slope_sign in paths.trt_segments(np.array(eta_prime)):
        inside = np.linspace(low, high, 101)[1:-1]
        if high > low:
            assert np.all(slope_sign * paths.exit_angle_slope(paths.TRT, inside, eta_prime) > -1e-9)
        covered += high - low
    assert covered == pytest.approx(np.pi)
