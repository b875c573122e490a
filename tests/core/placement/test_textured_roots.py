# SPDX-License-Identifier: GPL-3.0-or-later
"""An image gives no roots where it is black and a density by brightness elsewhere, the same for the same seed."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.faces.uv_maps import Texture
from hair_addon.core.geometry.mesh import positions
from hair_addon.core.placement.textured_roots import sample_textured
from tests.core.grooming.test_groom_defaults import plane


def sampled(values, count=4000, seed=1, density=None, cells=2):
    """Return (count, 2) positions in [0, 1] on a square that an image covers."""
    mesh, uvs = plane(1.0, cells)
    roots = sample_textured(mesh, count, seed, density, Texture(np.asarray(values, np.float32), uvs))
    np.testing.assert_allclose(roots.barycentric.sum(axis=1), 1.0, atol=1e-5)
    assert roots.barycentric.min() >= -1e-6 and roots.triangle.max() < len(mesh.triangles)
    return positions(mesh, roots)[:, :2] + 0.5


@pytest.mark.parametrize("cells", [2, 40])
def test_no_root_is_where_the_image_is_black(cells):
    """No root is on a small black mark in two large triangles."""
    values = np.zeros((100, 100))
    values[60:80, 10:30] = 1.0
    places = sampled(values, cells=cells)
    pixel = 0.025  # the image is linear between pixels, and the mask between corners of pieces
    assert (places >= (0.1 - pixel, 0.6 - pixel)).all() and (places <= (0.3 + pixel, 0.8 + pixel)).all()


def test_roots_are_as_many_as_the_image_is_bright():
    values = np.tile(np.repeat([0.1, 0.2, 0.3, 0.4], 32), (128, 1))
    places = sampled(values, count=40_000)
    counts = np.histogram(places[:, 0], bins=4, range=(0.0, 1.0))[0]
    np.testing.assert_allclose(counts / 40_000, [0.1, 0.2, 0.3, 0.4], atol=0.02)


def test_weights_multiply_the_image():
    mesh, _uvs = plane(1.0, 21)
    density = (mesh.vertices[:, 1] > 0.0).astype(np.float64)
    values = np.zeros((64, 64))
    values[:, 4:32] = 1.0  # not to the border, where the image begins again
    places = sampled(values, density=density, cells=21)
    assert (places[:, 0] < 0.52).all() and (places[:, 1] > 0.49).all()


def test_the_same_seed_gives_the_same_roots():
    values = np.zeros((32, 32))
    values[8:12, 8:12] = 1.0
    assert np.array_equal(sampled(values), sampled(values))
    assert not np.array_equal(sampled(values), sampled(values, seed=2))


def test_a_black_image_is_refused():
    with pytest.raises(HairError, match="density is zero"):
        sampled(np.zeros((8, 8)))
