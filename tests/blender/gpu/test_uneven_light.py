# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that varies around a fiber is scattered by shaders/fibre/zonal_light.glsl as by its integrals."""

import numpy as np

from tests.support.pictures import glsl

TEXT = "fibre/zonal_light.glsl"
COUNT = 500


def evaluate(expression, **inputs):
    return glsl.evaluate(glsl.source(TEXT), "vec3", expression, **inputs)[:, 0].astype(float)


def zonal_part(first, second, zonal_1, zonal_2):
    expression = "zonal_part(first, second, vec3(zonal_1), vec3(zonal_2))"
    return evaluate(expression, first=first, second=second, zonal_1=zonal_1, zonal_2=zonal_2)


def legendre_2(x):
    return 1.5 * x * x - 0.5


def test_bessel_function(rng):
    x = rng.uniform(-10.0, 10.0, COUNT)
    np.testing.assert_allclose(evaluate("bessel_i0(vec3(x))", x=x), np.i0(x), rtol=6e-3)


def test_even_light_has_no_part_but_one(rng):
    still, any_mean = np.zeros(COUNT), rng.uniform(-1.0, 1.0, COUNT)
    spread = rng.uniform(0.0, 1.0, COUNT) * (1.0 - any_mean**2)
    found = zonal_part(still, still, any_mean, legendre_2(np.sqrt(any_mean**2 + spread)))
    np.testing.assert_allclose(found, 1.0, atol=0.02)
    found = evaluate("azimuthal_part(vec3(first), vec3(turned))", first=still, turned=any_mean)
    np.testing.assert_allclose(found, 1.0, atol=1e-5)


def test_a_mirror_sees_light_that_varies_exponentially_as_it_is(rng):
    """A smooth fiber under light exp(b sin(theta_i)) shows the light at -theta_o, even if it is weak."""
    b = rng.uniform(-10.0, 10.0, COUNT)
    seen = rng.uniform(-1.0, 1.0, COUNT)
    sine = np.linspace(-1.0, 1.0, 20001)[:, None]
    light = np.exp(b * sine)
    light /= light.mean(axis=0)
    first, second = (light * sine).mean(axis=0), (light * legendre_2(sine)).mean(axis=0)
    found = zonal_part(first, second, seen, legendre_2(seen))
    expected = np.exp(b * seen) * b / np.sinh(b)
    assert np.abs(found - expected).max() < 0.15 * expected.max()
    assert np.median(np.abs(found / expected - 1.0)) < 0.15


def test_light_from_behind_is_not_seen_by_what_sends_light_back(rng):
    """A fiber's light is positive, and increases with the light from the directions that the fiber scatters."""
    first, turned = rng.uniform(-1.0, 1.0, (2, COUNT))
    found = evaluate("azimuthal_part(vec3(first), vec3(turned))", first=first, turned=turned)
    assert (found >= 0.0).all()
    agree = first * turned > 0.0
    strong = np.abs(first * turned) > 0.05
    assert (found[agree & strong] > 1.0).all()
    assert (found[~agree & strong] < 1.0).all()
    beam = evaluate("azimuthal_part(vec3(first), vec3(-1.0))", first=np.full(COUNT, 0.9))
    assert (beam < 0.02).all()
    small = 0.02 * first
    linear = evaluate("azimuthal_part(vec3(first), vec3(turned))", first=small, turned=turned)
    np.testing.assert_allclose(linear, 1.0 + 2.0 * small * turned, atol=2e-3)
