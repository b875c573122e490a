# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks are weights that are interpolated on the surface, multiplied, clipped and inverted."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.faces.uv_maps import Texture
from hair_addon.core.styling.masks import Mask
from tests.support.strands.styled import straight


@pytest.fixture(scope="module")
def hair():
    return straight(300)


def corners_of(hair, weights):
    """Return (F, 3) float32 of weights (V,) of vertices."""
    return weights.astype(np.float32)[hair.mesh.triangles]


def test_nothing_is_everywhere(hair):
    assert np.all(Mask().of_strands(hair.binding) == 1.0)
    assert np.all(Mask().of_guides(hair.guides.roots) == 1.0)
    assert np.all(Mask(is_inverted=True).of_strands(hair.binding) == 0.0)


def test_weights_of_vertices_are_linear_on_triangles(hair):
    weights = 10.0 * hair.mesh.vertices[:, 0]
    found = Mask(corners_of(hair, weights)).of_strands(hair.binding)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, 10.0 * hair.binding.positions.numpy()[:, 0], atol=1e-6)


def test_strands_and_guides_at_one_place_have_one_weight(hair, rng):
    mask = Mask(corners_of(hair, rng.random(len(hair.mesh.vertices))))
    np.testing.assert_array_equal(mask.of_guides(hair.binding.roots), mask.of_strands(hair.binding))


def test_weights_are_held_to_their_range(hair):
    found = Mask(corners_of(hair, 40.0 * hair.mesh.vertices[:, 0] - 1.0)).of_strands(hair.binding)
    assert found.min() == 0.0 and found.max() == 1.0
    broken = np.where(hair.mesh.vertices[:, 0] > 0.05, np.nan, 1.0)
    assert np.isfinite(Mask(corners_of(hair, broken)).of_strands(hair.binding)).all()


def test_inverted_is_one_minus(hair, rng):
    corners = corners_of(hair, rng.random(len(hair.mesh.vertices)))
    plain, inverted = (Mask(corners, is_inverted=is_inverted).of_strands(hair.binding) for is_inverted in (False, True))
    np.testing.assert_allclose(plain + inverted, 1.0, atol=1e-6)


def test_an_image_and_an_attribute_multiply(hair, rng):
    corners = corners_of(hair, rng.random(len(hair.mesh.vertices)))
    uvs = hair.mesh.vertices[:, :2] / 0.1
    texture = Texture(rng.random((8, 8)).astype(np.float32), uvs[hair.mesh.triangles])
    both, first, second = (
        mask.of_strands(hair.binding) for mask in (Mask(corners, texture), Mask(corners), Mask(None, texture))
    )
    np.testing.assert_allclose(both, first * second, atol=1e-6)


def test_weights_of_guides_are_the_guides_own(hair, rng):
    weights = rng.random(len(hair.guides)).astype(np.float32)
    np.testing.assert_allclose(Mask(guides=weights).of_guides(hair.guides.roots), weights, atol=1e-7)
    found = Mask(guides=weights).of_strands(hair.binding)
    followed = hair.binding.guide_weights.indices.numpy()
    highest = np.where(followed >= 0, weights[np.maximum(followed, 0)], -1.0).max(axis=1)
    lowest = np.where(followed >= 0, weights[np.maximum(followed, 0)], 2.0).min(axis=1)
    assert np.all((found >= lowest - 1e-6) & (found <= highest + 1e-6))
    np.testing.assert_allclose(Mask(guides=np.ones(len(weights))).of_strands(hair.binding), 1.0, atol=1e-6)


def test_weights_of_other_surfaces_and_guides_are_refused(hair):
    with pytest.raises(HairError):
        Mask(np.ones((1, 3), np.float32)).of_strands(hair.binding)
    with pytest.raises(HairError):
        Mask(guides=np.ones(1, np.float32)).of_strands(hair.binding)
    with pytest.raises(HairError):
        Mask(guides=np.ones(1, np.float32)).of_guides(hair.guides.roots)


def test_weights_are_those_of_positions(hair, rng):
    """Weights at positions equal those interpolated from vertices at roots."""
    weights = rng.random(len(hair.mesh.vertices))
    found = Mask(corners_of(hair, weights)).of_strands(hair.binding)
    np.testing.assert_allclose(found, mesh_math.interpolate(weights, hair.mesh, hair.binding.roots), atol=1e-6)
