# SPDX-License-Identifier: GPL-3.0-or-later
"""Data textures never have a side that is a power of two."""

import numpy as np
import pytest

from hair_addon.blender.gpu import light_grid, surface_textures
from hair_addon.core.texture_sides import avoid_powers_of_two


def is_power(lengths):
    return np.log2(lengths) % 1.0 == 0.0


def test_sides_are_the_least_that_are_not_powers_of_two():
    lengths = np.arange(1, 5000)
    found = avoid_powers_of_two(lengths)
    assert not is_power(found).any() and (found >= lengths).all()
    np.testing.assert_array_equal(found[~is_power(lengths)], lengths[~is_power(lengths)])
    np.testing.assert_array_equal(found - lengths, np.where(is_power(lengths), 1 + (lengths == 1), 0))


@pytest.mark.parametrize("vertex_count", [3, 6, 12, 768, 5461, 5462, 4 * 5461, 16384, 65536])
def test_surfaces_of_any_size(scene, vertex_count):
    vertices = np.random.default_rng(0).random((vertex_count, 3)).astype(np.float32)
    triangles = np.arange(vertex_count // 3 * 3, dtype=np.int32)
    surface = surface_textures.upload_surface(vertices, triangles)
    for texture in (surface.places, surface.corners.texture):
        assert not is_power(np.array([texture.width, texture.height])).any()


def test_light_by_voxel_keeps_its_place(scene):
    means = np.random.default_rng(0).random((4, 5, 8, 4))
    texture = light_grid.upload(means)
    sides = np.array([texture.width, texture.height])
    assert not is_power(sides).any()
    found = np.array(texture.read(), np.float32).reshape(-1, *sides[::-1], 4)
    np.testing.assert_allclose(found[:4, :5, :8], means, atol=1e-3)
    np.testing.assert_array_equal(found[4], found[3])
