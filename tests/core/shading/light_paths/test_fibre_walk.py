# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering of a path at a fiber equals that of `energy_conserving`."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.fibre import energy_conserving
from hair_addon.core.shading.fibre.angles import fibre_angles
from hair_addon.core.shading.light_paths import fibre_walk
from hair_addon.core.shading.tables import lookup_tables

wp.set_module_options({"enable_backward": False})

SETTINGS = lookup_tables.Settings(
    mode="energy", sigma_a=(0.02, 0.3, 1.5), roughness=0.4, radial_roughness=0.4, tilt=0.05, coat=0.3
)
TANGENT = np.array([0.0, 0.6, 0.8])
VIEWER = np.array([0.8, 0.0, 0.6])
EVEN = 1.0, 1.0, 1.0


@wp.func
def _fibre(row: wp.array[float]):
    fibre = fibre_walk.Fibre()
    fibre.tangent = wp.vec3(row[0], row[1], row[2])
    fibre.sigma_a = wp.vec3(row[3], row[4], row[5])
    fibre.roughness = row[6]
    fibre.eta = row[7]
    fibre.scale = row[8]
    fibre.tilt = row[9]
    fibre.tilt_trt = row[10]
    fibre.coat = row[11]
    return fibre


@wp.kernel
def _values(
    row: wp.array[float],
    viewer: wp.vec3,
    lights: wp.array[wp.vec3],
    weight: wp.vec3,
    out_values: wp.array2d[wp.vec3],
    out_densities: wp.array2d[float],
):
    light, step = wp.tid()
    h = 2.0 * (float(step) + 0.5) / float(out_values.shape[1]) - 1.0
    found, density = fibre_walk.value(_fibre(row), viewer, lights[light], h, weight)
    out_values[light, step] = found
    out_densities[light, step] = density


@wp.kernel
def _turns(
    row: wp.array[float],
    viewer: wp.vec3,
    weight: wp.vec3,
    out_directions: wp.array[wp.vec3],
    out_weights: wp.array[wp.vec3],
    out_even: wp.array[wp.vec3],
):
    path = wp.tid()
    state = wp.rand_init(7, path)
    h = 2.0 * wp.randf(state) - 1.0
    direction, left, _state = fibre_walk.turn(_fibre(row), viewer, weight, h, state)
    out_directions[path] = direction
    out_weights[path] = left
    out_even[path] = fibre_walk.even_return(_fibre(row), viewer)


@pytest.fixture(scope="module")
def row():
    scale = float(fibre_walk_scale(SETTINGS))
    values = [*TANGENT, *SETTINGS.sigma_a, SETTINGS.roughness, SETTINGS.eta, scale, SETTINGS.tilt, 4.0, SETTINGS.coat]
    return wp.array(np.array(values, np.float32), dtype=float)


def fibre_walk_scale(settings):
    return energy_conserving.scale_from_radial_roughness(settings.radial_roughness)


@pytest.fixture(scope="module")
def turns(row):
    return turned(row, EVEN)


def turned(row, weight):
    """Return directions, weights and the values for even light of many scattering events."""
    found = [wp.zeros(200_000, dtype=wp.vec3) for _ in range(3)]
    wp.launch(_turns, dim=len(found[0]), inputs=[row, wp.vec3(*VIEWER), wp.vec3(*weight)], outputs=found)
    return [array.numpy().astype(float) for array in found]


def valued(row, lights, weight, offset_count):
    """Return values (L, offsets, 3) and densities (L, offsets) of lights (L, 3)."""
    found = wp.zeros((len(lights), offset_count), dtype=wp.vec3), wp.zeros((len(lights), offset_count), dtype=float)
    inputs = [row, wp.vec3(*VIEWER), wp.array(lights.astype(np.float32), dtype=wp.vec3), wp.vec3(*weight)]
    wp.launch(_values, dim=found[0].shape, inputs=inputs, outputs=found)
    return [array.numpy().astype(float) for array in found]


def test_values_are_those_of_the_model(row, rng):
    lights = rng.normal(size=(12, 3))
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    found, _densities = valued(row, lights, EVEN, 2000)
    tangents, viewers = (np.broadcast_to(one, lights.shape) for one in (TANGENT, VIEWER))
    expected = energy_conserving.scattering(fibre_angles(tangents, lights, viewers), SETTINGS)
    np.testing.assert_allclose(found.mean(axis=1), expected, rtol=0.02, atol=1e-4)


def test_turns_are_distributed_as_the_values(row, turns):
    """Sampled directions are distributed as the values, by the moments of the light's direction over the sphere."""
    directions, weights, even = turns
    z, turn = np.meshgrid((np.arange(48) + 0.5) / 24 - 1.0, 2.0 * np.pi * (np.arange(96) + 0.5) / 96)
    across = np.sqrt(1.0 - z.ravel() ** 2)
    lights = np.stack([across * np.cos(turn.ravel()), across * np.sin(turn.ravel()), z.ravel()], axis=-1)
    tangents, viewers = (np.broadcast_to(one, lights.shape) for one in (TANGENT, VIEWER))
    values = energy_conserving.scattering(fibre_angles(tangents, lights, viewers), SETTINGS)
    measure = 4.0 * np.pi / len(lights)
    np.testing.assert_allclose(weights.mean(axis=0), values.sum(axis=0) * measure, rtol=0.02)
    np.testing.assert_allclose(even[0], weights.mean(axis=0), rtol=0.02)
    for first in range(3):
        expected = (values * lights[:, first : first + 1]).sum(axis=0) * measure
        np.testing.assert_allclose((weights * directions[:, first : first + 1]).mean(axis=0), expected, atol=0.01)
        expected = (values * lights[:, first : first + 1] ** 2).sum(axis=0) * measure
        np.testing.assert_allclose((weights * directions[:, first : first + 1] ** 2).mean(axis=0), expected, atol=0.01)


def test_densities_are_those_of_turns(row):
    """The moments of the directions agree for a path without red, whose lobes have other shares."""
    weight = 0.0, 0.2, 1.0
    directions = turned(row, weight)[0]
    z, turn = np.meshgrid((np.arange(48) + 0.5) / 24 - 1.0, 2.0 * np.pi * (np.arange(96) + 0.5) / 96)
    across = np.sqrt(1.0 - z.ravel() ** 2)
    lights = np.stack([across * np.cos(turn.ravel()), across * np.sin(turn.ravel()), z.ravel()], axis=-1)
    chance = valued(row, lights, weight, 64)[1].mean(axis=1) * (4.0 * np.pi / len(lights))
    assert chance.sum() == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(directions.mean(axis=0), chance @ lights, atol=0.01)
    np.testing.assert_allclose((directions**2).mean(axis=0), chance @ lights**2, atol=0.01)
