# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering of a path at a surface agrees in sampling and evaluation, conserves energy, and equals Principled BSDF."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.light_paths import surface_walk
from hair_addon.core.shading.tables import surface_albedo

wp.set_module_options({"enable_backward": False})

UP = 0.0, 0.0, 1.0
# Base color, (roughness, metallic, reflectance at normal incidence).
USUAL = (0.8, 0.8, 0.8), (0.5, 0.0, 0.04)
SMOOTH = (0.6, 0.3, 0.1), (0.25, 0.0, (0.8 / 2.8) ** 2)
METAL = (0.9, 0.6, 0.2), (0.4, 1.0, 0.04)
MATT = (0.6, 0.3, 0.1), (1.0, 0.0, 0.0)


@wp.kernel
def _values(
    viewer: wp.vec3,
    color: wp.vec3,
    gloss: wp.vec3,
    table: wp.array2d[wp.vec4],
    weight: wp.vec3,
    lights: wp.array[wp.vec3],
    out_values: wp.array[wp.vec3],
    out_densities: wp.array[float],
):
    light = wp.tid()
    surface = surface_walk.surface_of(wp.vec3(0.0, 0.0, 1.0), viewer, color, gloss, table)
    value, density = surface_walk.surface_value(surface, lights[light], weight)
    out_values[light] = value
    out_densities[light] = density


@wp.kernel
def _turns(
    viewer: wp.vec3,
    color: wp.vec3,
    gloss: wp.vec3,
    table: wp.array2d[wp.vec4],
    weight: wp.vec3,
    out_directions: wp.array[wp.vec3],
    out_weights: wp.array[wp.vec3],
):
    path = wp.tid()
    surface = surface_walk.surface_of(wp.vec3(0.0, 0.0, 1.0), viewer, color, gloss, table)
    along = wp.vec3(1.0, 0.0, 0.0)
    direction, left, _state = surface_walk.surface_turn(surface, along, weight, wp.rand_init(7, path))
    out_directions[path] = direction
    out_weights[path] = left


def direction(theta, phi=0.0):
    """Return the unit vector at an angle to the normal and an azimuth [degrees]."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0.0 * phi], axis=-1)


def inputs(viewer, material, weight):
    color, gloss = material
    table = wp.array(surface_albedo.table(), dtype=wp.vec4, device="cpu")
    return [wp.vec3(*viewer), wp.vec3(*color), wp.vec3(*gloss), table, wp.vec3(*weight)]


def values(viewer, lights, material, weight=(1.0, 1.0, 1.0)):
    lights = wp.array(np.atleast_2d(lights).astype(np.float32), dtype=wp.vec3, device="cpu")
    found, densities = (
        wp.zeros(len(lights), dtype=wp.vec3, device="cpu"),
        wp.zeros(len(lights), dtype=float, device="cpu"),
    )
    wp.launch(_values, len(lights), [*inputs(viewer, material, weight), lights, found, densities], device="cpu")
    return found.numpy(), densities.numpy()


def turns(viewer, material, count, weight=(1.0, 1.0, 1.0)):
    found = [wp.zeros(count, dtype=wp.vec3, device="cpu") for _ in range(2)]
    wp.launch(_turns, count, [*inputs(viewer, material, weight), *found], device="cpu")
    return [array.numpy() for array in found]


@pytest.mark.parametrize(
    ("material", "angles", "expected"),
    [
        (USUAL, (30, 30, 180), 0.27271),
        (USUAL, (30, 60, 90), 0.20793),
        (USUAL, (60, 60, 180), 0.32970),
        (USUAL, (75, 75, 180), 0.98191),
        (USUAL, (75, 40, 0), 0.06344),
        (USUAL, (20, 80, 180), 0.21646),
        (SMOOTH, (60, 60, 180), (5.54556, 5.50420, 5.47664)),
        (SMOOTH, (30, 60, 90), (0.14367, 0.07205, 0.02430)),
        (METAL, (30, 30, 180), (3.33264, 2.19647, 0.72145)),
        (METAL, (60, 60, 180), (5.79896, 3.84652, 1.37244)),
    ],
)
def test_light_is_that_of_principled_bsdf(material, angles, expected):
    """Light is that of Cycles' Principled BSDF in Blender 5.2 under a sun of strength 1, by angles of light and
    camera.
    """
    light, view, between = angles
    found, _density = values(direction(view, between), direction(light), material)
    np.testing.assert_allclose(found[0] * np.ones(3), expected * np.ones(3), rtol=0.03)


@pytest.mark.parametrize("angle", [5, 50, 80])
@pytest.mark.parametrize("material", [USUAL, SMOOTH, METAL, MATT])
def test_directions_are_as_dense_as_the_value_says(material, angle):
    """In each part of the upper hemisphere, the probability and the light of directions agree with the value."""
    viewer, weight = direction(angle, 180.0), (1.0, 0.5, 0.2)
    sides = 400
    cosine, azimuth = np.meshgrid((np.arange(sides) + 0.5) / sides, 360.0 * (np.arange(sides) + 0.5) / sides)
    lights = direction(np.degrees(np.arccos(cosine)), azimuth).reshape(-1, 3)
    value, density = values(viewer, lights, material, weight)
    area = 2.0 * np.pi / sides**2
    taken, left = turns(viewer, material, 40_000, weight)

    def bins(places, weights):
        coarse = 8 * np.clip((8.0 * places[:, 2]).astype(int), 0, 7)
        coarse += ((np.arctan2(places[:, 1], places[:, 0]) / np.pi + 1.0) * 4.0).astype(int).clip(0, 7)
        return np.bincount(coarse[places[:, 2] > 0.0], weights[places[:, 2] > 0.0], 64)

    expected, found = bins(lights, density * area), bins(taken, np.full(len(taken), 1.0 / len(taken)))
    np.testing.assert_allclose(found, expected, atol=0.012)
    for channel in range(3):
        expected = bins(lights, weight[channel] * value[:, channel] * area)
        np.testing.assert_allclose(bins(taken, left[:, channel] / len(taken)), expected, atol=0.012)


@pytest.mark.parametrize("gloss", [(1.0, 0.0, 0.0), (0.5, 0.0, 0.04), (0.25, 0.0, 0.08), (0.7, 1.0, 0.04)])
@pytest.mark.parametrize("angle", [10, 60, 85])
def test_a_white_surface_is_lost_in_a_white_world(gloss, angle):
    _directions, left = turns(direction(angle), ((1.0, 1.0, 1.0), gloss), 100_000)
    np.testing.assert_allclose(left.mean(axis=0), 1.0, atol=0.02)
