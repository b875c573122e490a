# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of polygons in a picture do not overlap, and larger polygons have larger blocks."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.faces import face_atlas
from hair_addon.core.geometry.mesh import Faces


def polygons(rng, count):
    """Return `Faces` of three to six corners with (V, 3) vertices: regular polygons of very different sizes."""
    counts = rng.integers(3, 7, count)
    starts = np.append(0, np.cumsum(counts)).astype(np.int32)
    turn = 2.0 * np.pi * (np.arange(starts[-1]) - np.repeat(starts[:-1], counts)) / np.repeat(counts, counts)
    sizes = np.repeat(10.0 ** rng.uniform(-3.0, 0.0, count), counts)
    vertices = sizes[:, None] * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    return Faces(np.arange(starts[-1], dtype=np.int32), starts), vertices


@pytest.mark.parametrize("count", [1, 7, 900, 5000])
def test_no_texel_belongs_to_two_polygons(rng, count):
    """The boxes of texels around polygons, which are a texel apart, are disjoint and inside of the picture."""
    faces, vertices = polygons(rng, count)
    uvs, side = face_atlas.face_atlas(faces, vertices, 256)
    assert side * side >= 16 * count and side in (256, 512)
    low = np.floor(np.minimum.reduceat(uvs, faces.starts[:-1]) * side + 0.01).astype(int)
    high = np.ceil(np.maximum.reduceat(uvs, faces.starts[:-1]) * side - 0.01).astype(int)
    assert low.min() >= 1 and high.max() <= side - 1
    covered = np.zeros((side, side), np.int32)
    for (left, bottom), (right, top) in zip(low, high, strict=True):
        covered[bottom - 1 : top, left - 1 : right] += 1
    assert covered.max() == 1


def test_blocks_are_as_large_as_polygons_and_fill_the_picture(rng):
    """Where blocks are above the least size, their sides are those of polygons within a factor of 4, and blocks fill at
    least a fifth of the picture.
    """
    faces, vertices = polygons(rng, 400)
    uvs, side = face_atlas.face_atlas(faces, vertices, 512)
    sizes = (np.maximum.reduceat(uvs, faces.starts[:-1]) - np.minimum.reduceat(uvs, faces.starts[:-1])).max(axis=1)
    roots = np.sqrt(face_atlas._areas(faces, vertices))
    ratio = (sizes / roots)[sizes * side > 8]
    assert ratio.max() / ratio.min() < 4.0
    assert np.square(sizes).sum() > 0.2


def test_broken_and_too_many_polygons():
    faces = Faces(np.arange(4, dtype=np.int32), np.array([0, 4], np.int32))
    uvs, _side = face_atlas.face_atlas(faces, np.full((4, 3), np.nan), 64)
    assert np.isfinite(uvs).all()
    many = np.arange(0, 3 * 1_100_000 + 1, 3, dtype=np.int32)
    with pytest.raises(HairError, match="fewer than a million"):
        face_atlas.face_atlas(Faces(np.zeros(many[-1], np.int32), many), np.zeros((1, 3)), 64)
