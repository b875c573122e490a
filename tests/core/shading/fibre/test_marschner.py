# SPDX-License-Identifier: GPL-3.0-or-later
"""The Marschner model satisfies normalization, reciprocity, symmetry and energy, and agrees with published figures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from hair_addon.core.errors import HairError
from hair_addon.core.shading.fibre import marschner, paths
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pairs import share_of

ETA = 1.55
NO_ABSORPTION = (0.0, 0.0, 0.0)
DEGREE = np.pi / 180.0


def random_angles(rng, count):
    theta_i, theta_o = rng.uniform(-1.4, 1.4, (2, count))
    return FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, count))


def test_m_is_of_unit_area_in_theta_o():
    for alpha, beta in marschner.longitudinal_lobes(marschner.Settings(beta_r=5.0 * DEGREE)):
        area, _ = quad(lambda theta_o: marschner.m_lobe(0.5 * (0.2 + theta_o), alpha, beta), -3.0, 3.0, limit=200)  # noqa: B023
        assert area == pytest.approx(1.0, abs=1e-6)


def test_cuticle_tilt_turns_the_highlights_apart_as_a_traced_wedge_does():
    """The cuticle tilt turns highlights as a traced wedge does: R by -1, TT by eta - 1 and TRT by 2 eta - 1 tilts."""
    tilt = 3.0 * DEGREE
    centres = [alpha for alpha, _ in marschner.longitudinal_lobes(marschner.Settings(tilt=tilt))]
    np.testing.assert_allclose(centres, [-tilt, 0.55 * tilt, 2.1 * tilt], atol=0.1001 * tilt)
    theta_h = np.linspace(-0.3, 0.3, 6001)
    peaks = [
        theta_h[np.argmax(marschner.m_lobe(theta_h, alpha, beta))]
        for alpha, beta in marschner.longitudinal_lobes(marschner.Settings(tilt=tilt, shifts="PUBLISHED"))
    ]
    np.testing.assert_allclose(peaks, [-tilt, 0.5 * tilt, 1.5 * tilt], atol=1e-4)


def test_mirrored_light_leaves_as_fresnel_says():
    """Mirrored light leaves as Fresnel says: straight back, N_R is a quarter of the reflectance; a mirror's N_R is 1
    over phi.
    """
    assert marschner.n_r(0.0, 1.0, ETA) == pytest.approx(0.25 * (0.55 / 2.55) ** 2)
    total, _ = quad(lambda phi: marschner.n_r(phi, 1e-6, ETA), -np.pi, np.pi)
    assert total == pytest.approx(1.0, abs=1e-4)


def test_straight_through_light_crosses_two_surfaces_and_one_diameter():
    """Straight through, light crosses two surfaces and one diameter: at phi = pi, dphi/dgamma = 2 / eta - 2."""
    fresnel = (0.55 / 2.55) ** 2
    expected = 0.5 * (1.0 - fresnel) ** 2 * np.exp(-2.0 * 0.7) / (2.0 - 2.0 / ETA)
    assert marschner.n_tt(np.pi, 1.0, ETA, (0.7,))[0] == pytest.approx(expected)


@pytest.mark.parametrize("cos_theta_d", [1.0, 0.7, 0.2])
def test_tt_ends_where_its_rim_rays_leave(cos_theta_d):
    edge = 2.0 * np.arcsin(cos_theta_d / np.sqrt(ETA**2 - 1.0 + cos_theta_d**2))
    beside = marschner.n_tt(edge + np.array([-1e-9, 0.02]), cos_theta_d, ETA, (0.1,))[:, 0]
    assert beside[0] == 0.0
    assert beside[1] > 0.0
    if cos_theta_d == 1.0:
        assert np.degrees(edge) == pytest.approx(80.4, abs=0.05)


def test_trt_has_one_root_beyond_the_caustic_and_three_inside():
    """Just inside the caustic N_TRT is far brighter than just outside; past the rim's exit it is black."""
    phi = np.radians([18.5, 18.7, 19.4])
    inside, outside, beyond = marschner.n_trt(phi, 1.0, ETA, (0.0,))[:, 0]
    assert inside > 3.0 * outside > 0.0
    assert beyond == 0.0


def test_trt_does_not_count_the_root_at_zero_twice():
    """For eta' >= 2 only the axial ray leaves straight back."""
    cos_theta_d = 0.5
    eta_prime = np.sqrt(ETA**2 - 1.0 + cos_theta_d**2) / cos_theta_d
    axial = paths.path_attenuation(paths.TRT, np.array(0.0), np.array(cos_theta_d), ETA, (0.2,))[0]
    expected = 0.5 * axial / (2.0 - 4.0 / eta_prime)
    assert marschner.n_trt(0.0, cos_theta_d, ETA, (0.2,))[0] == pytest.approx(expected)


@given(st.floats(0.0, np.pi), st.floats(0.05, 1.0))
def test_scattering_is_even_in_phi(phi, cos_theta_d):
    settings = marschner.Settings()
    assert marschner.n_r(phi, cos_theta_d, ETA) == marschner.n_r(-phi, cos_theta_d, ETA)
    for n in (marschner.n_tt, marschner.n_trt):
        there, back = (n(azimuth, cos_theta_d, ETA, (0.3,)) for azimuth in (phi, -phi))
        np.testing.assert_array_equal(there, back)
    there, back = (marschner.n_trt_caustic(azimuth, cos_theta_d, settings) for azimuth in (phi, -phi))
    np.testing.assert_array_equal(there, back)


@pytest.mark.parametrize("caustic", ["exact", "published"])
def test_light_and_viewer_may_change_places(rng, caustic):
    settings = marschner.Settings(caustic=caustic)
    there = random_angles(rng, 500)
    back = FibreAngles(there.theta_o, there.theta_i, -there.phi)
    np.testing.assert_allclose(
        marschner.scattering(there, settings), marschner.scattering(back, settings), rtol=1e-6, atol=1e-12
    )


def test_more_absorption_never_brightens(rng):
    angles = random_angles(rng, 500)
    pale = marschner.scattering(angles, marschner.Settings(sigma_a=(0.1, 0.2, 0.3)))
    dark = marschner.scattering(angles, marschner.Settings(sigma_a=(0.2, 0.4, 0.6)))
    assert (dark <= pale).all()
    assert (dark >= 0.0).all()


def glint_energy(degrees, gain, width):
    """Return the energy of N_TRT after the caustic treatment relative to that before, integrated over phi and over
    h.
    """
    cos_theta_d = np.cos(degrees * DEGREE)
    settings = marschner.Settings(sigma_a=NO_ABSORPTION, glint_gain=gain, glint_width=width * DEGREE)
    phi = (np.arange(20_000) + 0.5) / 20_000 * np.pi
    treated = 2.0 * marschner.n_trt_caustic(phi, cos_theta_d, settings)[:, 0].mean() * np.pi
    gamma = (np.arange(2000) + 0.5) / 2000 * np.pi / 2
    left = paths.path_attenuation(paths.TRT, gamma, np.array(cos_theta_d), ETA, (0.0,))[:, 0]
    return treated / (np.mean(left * np.cos(gamma)) * np.pi / 2)


@pytest.mark.parametrize(
    ("degrees", "gain", "width", "published"),
    [
        (0, 1.0, 10, 1.20),
        (0, 1.0, 15, 1.05),
        (0, 1.0, 25, 0.97),
        (0, 2.5, 10, 2.62),
        (0, 5.0, 10, 4.99),
        (40, 1.0, 10, 0.90),
        (40, 1.0, 15, 0.84),
        (40, 1.0, 25, 0.79),
    ],
)
def test_caustic_treatment_has_the_published_energy(degrees, gain, width, published):
    assert glint_energy(degrees, gain, width) == pytest.approx(published, abs=0.006)


def test_caustic_treatment_is_continuous_where_the_caustics_merge():
    """The treatment is continuous at eta' = 2, where the published smoothstep would jump from full strength to none."""
    merge = np.sqrt((ETA**2 - 1.0) / 3.0)
    phi = np.linspace(0.0, 1.5, 200)
    before, after = (marschner.n_trt_caustic(phi, merge * factor, marschner.Settings()) for factor in (1.0001, 0.9999))
    np.testing.assert_allclose(before, after, rtol=0.02, atol=1e-4)


def test_published_treatment_is_bounded_where_the_cylinder_is_not():
    phi_c = 18.6157517 * DEGREE
    assert marschner.n_trt(phi_c, 1.0, ETA, (0.0,))[0] > 5.0
    assert marschner.n_trt_caustic(phi_c, 1.0, marschner.Settings(sigma_a=NO_ABSORPTION)).max() < 0.2


def white_albedo(degrees, settings):
    """int int S cos²(theta_o) dtheta_o dphi for light at theta_i, by quadrature over the model's own lobes."""
    theta_i = degrees * DEGREE
    theta_o = (np.arange(400) + 0.5) / 400 * np.pi - np.pi / 2
    phi = (np.arange(1024) + 0.5) / 1024 * np.pi
    angles = FibreAngles(theta_i, theta_o[:, None], phi[None, :])
    s = lookup_tables.sample_scattering(lookup_tables.bake(settings), angles)[..., 0]
    return 2.0 * np.sum(s * np.cos(theta_o)[:, None] ** 2) * (np.pi / 400) * (np.pi / 1024)


PUBLISHED = {0: 0.969, 30: 0.963, 45: 0.949, 60: 0.907, 70: 0.848, 75: 0.815, 80: 0.802, 85: 0.880}


@pytest.mark.parametrize("degrees", share_of(PUBLISHED, 2))
def test_white_fibre_returns_the_published_part_of_light(degrees):
    """With the factor ½ in M a white fiber returns almost all light; without it, nearly twice as much."""
    settings = lookup_tables.Settings(
        eta=ETA, sigma_a=NO_ABSORPTION, tilt=0.0, beta_r=7.5 * DEGREE, caustic="exact", size=256
    )
    assert white_albedo(degrees, settings) == pytest.approx(PUBLISHED[degrees], abs=0.004)


@pytest.mark.parametrize(("degrees", "published"), [(0, 0.950), (45, 1.040), (60, 1.050), (75, 0.988)])
def test_tilted_white_fibre_returns_the_published_part_of_light(degrees, published):
    settings = lookup_tables.Settings(
        eta=ETA, sigma_a=NO_ABSORPTION, tilt=7.5 * DEGREE, beta_r=7.5 * DEGREE, caustic="exact", shifts="PUBLISHED"
    )
    assert white_albedo(degrees, settings) == pytest.approx(published, abs=0.004)


@pytest.mark.parametrize(
    "wrong",
    [
        {"eta": 1.0},
        {"eta": np.nan},
        {"sigma_a": (-0.1, 0.0, 0.0)},
        {"sigma_a": (np.inf, 0.0, 0.0)},
        {"sigma_a": (0.1, 0.2)},
        {"beta_r": 0.0},
        {"caustic": "none"},
        {"glint_width": 0.0},
        {"glint_fade": 0.0},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(HairError):
        marschner.Settings(**wrong)
