# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment split into lobes and a rest loses no light, and known lobes are found again."""

import numpy as np
import pytest

from hair_addon.core.imaging import ambient_cube, environment

HEIGHT = 48


def surroundings(radiance_of):
    """Return (H, W, 3) radiance by a function of unit directions (N, 3)."""
    directions, _solid_angles = environment._texels(HEIGHT, 2 * HEIGHT)
    return np.broadcast_to(radiance_of(directions)[:, None], (len(directions), 3)).reshape(HEIGHT, 2 * HEIGHT, 3)


def test_solid_angles_fill_the_sphere():
    directions, solid_angles = environment._texels(HEIGHT, 2 * HEIGHT)
    assert solid_angles.sum() == pytest.approx(4.0 * np.pi)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)


def test_even_light_has_no_lobes_and_the_same_sides():
    lobes, sides = environment.split(surroundings(lambda directions: np.full(len(directions), 0.7)))
    assert lobes == []
    np.testing.assert_allclose(sides, 0.7)


@pytest.mark.parametrize("sharpness", [60.0, 150.0])
def test_a_bright_lobe_is_found_with_its_place_light_and_width(rng, sharpness):
    """A bright lobe is found with its place, light and width: sharpness s has irradiance 2 pi / s and variance 1 /
    s.
    """
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    (lobe,), sides = environment.split(
        surroundings(lambda directions: 0.2 + 20.0 * np.exp(sharpness * (directions @ axis - 1.0)))
    )
    assert lobe.direction @ axis > np.cos(np.radians(2.0))
    np.testing.assert_allclose(lobe.irradiance, 20.0 * 2.0 * np.pi / sharpness, rtol=0.05)
    assert lobe.variance == pytest.approx(1.0 / sharpness, rel=0.1)
    np.testing.assert_allclose(sides, 0.2, atol=0.02)


def test_a_wide_lobe_gives_a_ball_all_its_light():
    """A wide lobe gives a ball all its light; the variance accounts for the 4 % less on a plane that faces a 29°
    cone.
    """
    least = np.cos(np.radians(29.0))
    (lobe,), _sides = environment.split(
        surroundings(lambda directions: 5.0 * np.maximum(directions[:, 1] - least, 0.0) / (1.0 - least))
    )
    plane = 10.0 * np.pi * ((1.0 - least**3) / 3.0 - 0.5 * least * (1.0 - least**2)) / (1.0 - least)
    np.testing.assert_allclose(lobe.irradiance, 5.0 * np.pi * (1.0 - least), rtol=0.01)
    np.testing.assert_allclose(lobe.irradiance * (1.0 - lobe.variance), plane, rtol=0.01)


def test_two_lamps_are_two_lobes():
    lamps = np.array([[0.6, 0.0, 0.8], [-0.8, 0.6, 0.0]])
    lobes, _sides = environment.split(
        surroundings(lambda directions: np.exp(60.0 * (directions @ lamps.T - 1.0)) @ [20.0, 10.0])
    )
    np.testing.assert_allclose([lobe.direction for lobe in lobes], lamps, atol=0.03)
    assert lobes[0].irradiance[0] == pytest.approx(2.0 * lobes[1].irradiance[0], rel=0.05)


def test_black_and_broken_pictures_give_no_light():
    lobes, sides = environment.split(np.zeros((HEIGHT, 2 * HEIGHT, 3)))
    assert lobes == [] and not sides.any()
    lobes, sides = environment.split(np.full((HEIGHT, 2 * HEIGHT, 3), -1.0))
    assert lobes == [] and not sides.any()


def test_directions_average_polynomials_of_degree_five():
    """Directions average polynomials of degree five: over the sphere x² is 1/3, x⁴ 1/5, x² y² 1/15, odd powers 0."""
    x, y, _z = ambient_cube.DIRECTIONS.T
    means = [float(ambient_cube.WEIGHTS @ values) for values in (x**0, x**2, x**4, x**2 * y**2, x**3 * y**2, x)]
    np.testing.assert_allclose(means, [1.0, 1 / 3, 1 / 5, 1 / 15, 0.0, 0.0], atol=1e-12)


def test_sides_share_every_direction(rng):
    directions = rng.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    shares = ambient_cube.side_shares(directions)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    for axis in range(3):
        assert (shares[directions[:, axis] > 0.0, 2 * axis + 1] == 0.0).all()


def test_an_image_that_is_turned_gives_turned_light():
    """An image turned about an axis gives turned light, up to the positions of texels, for a sun and a sky with a
    bright side.
    """
    cosine, sine = np.cos(0.7), np.sin(0.7)
    to_image = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    axis = np.array([0.48, 0.6, 0.64])

    def radiance_of(directions):
        return 1.0 + directions[:, 0] + 20.0 * np.exp(100.0 * (directions @ axis - 1.0))

    lobes, left = environment.decompose(surroundings(radiance_of))
    (lobe,), sides = environment.turned(lobes, left, to_image)
    (other,), other_sides = environment.split(surroundings(lambda directions: radiance_of(directions @ to_image.T)))
    assert lobe.direction @ other.direction > np.cos(np.radians(1.0))
    assert lobe.direction @ (to_image.T @ axis) > np.cos(np.radians(3.0))
    np.testing.assert_allclose(lobe.irradiance, other.irradiance, rtol=0.05)
    np.testing.assert_allclose(sides, other_sides, rtol=0.02)
