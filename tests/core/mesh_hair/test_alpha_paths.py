# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of cards run along the opaque parts of the texture, and fill them."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.mesh_hair import alpha_paths, piece_strands, texture_alpha
from hair_addon.core.mesh_hair.mesh_strand_settings import MeshStrandSettings

FLOOR = TriMesh(
    np.array([(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)], np.float32), np.array([(0, 1, 2), (0, 2, 3)])
)
WIDTH, LENGTH, ROWS = 0.02, 0.16, 8


def card(scale=(1.0, 1.0, 1.0)):
    """Return an upright flat card and its UV coordinates (F, 3, 2); V is 0 at the root."""
    uv = np.stack(np.meshgrid([0.0, 1.0], np.linspace(0.0, 1.0, ROWS + 1)), axis=-1).reshape(-1, 2)
    vertices = np.stack([WIDTH * uv[:, 0], 0.0 * uv[:, 0], 0.01 + LENGTH * uv[:, 1]], axis=1) * scale
    first = 2 * np.arange(ROWS)
    triangles = np.concatenate([first[:, None] + (0, 1, 3), first[:, None] + (0, 3, 2)]).astype(np.int32)
    return TriMesh(vertices.astype(np.float32), triangles), uv[triangles]


def locks(rng, kind):
    """Return alpha (256, 256), of V and U: wavy locks that part, join, and taper, end or begin behind the root."""
    along, across = (np.mgrid[0:256, 0:256] + 0.5) / 256
    found = np.zeros(along.shape, bool)
    count = int(rng.integers(3, 7))
    for lock in range(count):
        middle = (lock + 0.5) / count + rng.uniform(-0.05, 0.05) + rng.uniform(0.0, 0.06) * np.sin(6.0 * along + lock)
        end, width = rng.uniform(0.65, 1.0), rng.uniform(0.4, 0.65) / count
        size = width * np.sqrt(np.clip((end - along) / end, 0.0, 1.0)) if kind == "tapered" else width * (along < end)
        found |= np.abs(across - middle) < size
    return (found & (along > (0.06 if kind == "set back" else 0.0))).astype(np.float64)


def looked_up(alpha, uvs):
    at = np.clip((uvs * alpha.shape[0]).astype(int), 0, alpha.shape[0] - 1)
    return alpha[at[:, 1], at[:, 0]]


def strands_of(alpha, scale=(1.0, 1.0, 1.0), **settings):
    """Return the strands of a card with a texture."""
    mesh, uvs = card(scale)

    def alpha_at(places):
        return looked_up(alpha, np.einsum("nc,ncu->nu", places.barycentric, uvs[places.triangle]))

    chosen = MeshStrandSettings(root_end="LOW_V", **settings)
    found = piece_strands.mesh_strands(mesh, FLOOR, chosen, uvs, alpha_at=alpha_at)
    return texture_alpha.shown(found, alpha_at(found.places), alpha_at, mesh)


def covered(found, scale):
    """Return (256, 256) bool, of V and U: whether a place on the card lies within the radius of a strand."""
    places = (np.arange(256) + 0.5) / 256
    image = np.zeros((256, 256), bool)
    for points, radii in zip(
        np.split(found.points, found.starts[1:-1]), np.split(found.radii, found.starts[1:-1]), strict=True
    ):
        height = (points[:, 2] / scale[2] - 0.01) / LENGTH
        rows = np.flatnonzero((places >= height[0]) & (places <= height[-1]))
        size = WIDTH * scale[0]
        middle, radius = (np.interp(places[rows], height, each) for each in (points[:, 0] / size, radii / abs(size)))
        image[rows] |= np.abs(places - middle[:, None]) <= radius[:, None]
    return image


@pytest.mark.parametrize("kind", ["tapered", "cut", "set back"])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-100.0, 100.0, 100.0), (0.02, 0.01, 0.01)])
def test_strands_fill_the_opaque_part_of_a_texture(rng, kind, scale):
    """Strands that fill a card share more than 0.95 of their area with the opaque part, between its locks too."""
    for _card in range(2):
        alpha = locks(rng, kind)
        image, opaque = covered(strands_of(alpha, scale, strand_count=200, fills=True), scale), alpha > 0.5
        assert (image & opaque).sum() / (image | opaque).sum() > 0.95


def test_points_of_strands_are_opaque(rng):
    """No strand crosses a gap, with random offsets across the card too."""
    for kind in ("tapered", "cut", "set back"):
        alpha = locks(rng, kind)
        found = strands_of(alpha, strand_count=100)
        uvs = np.stack([found.points[:, 0] / WIDTH, (found.points[:, 2] - 0.01) / LENGTH], axis=1)
        assert looked_up(alpha, uvs).mean() > 0.98


@pytest.mark.parametrize(("slope", "least"), [(0.0, 0.98), (0.05, 0.75)])
def test_few_strands_stay_on_fine_locks(slope, least):
    """Strands stay on 40 locks that are as narrow as the cells in which the texture is sampled."""
    along, across = (np.mgrid[0:1024, 0:1024] + 0.5) / 1024
    alpha = ((across + slope * along) * 40.0 % 1.0 < 0.4).astype(np.float64)
    for count in (1, 3, 8, 20):
        found = strands_of(alpha, strand_count=count)
        uvs = np.stack([found.points[:, 0] / WIDTH, (found.points[:, 2] - 0.01) / LENGTH], axis=1)
        assert len(found.counts) == count and looked_up(alpha, uvs).mean() > least


def test_an_opaque_texture_changes_nothing():
    mesh, uvs = card()
    plain = piece_strands.mesh_strands(mesh, FLOOR, MeshStrandSettings(strand_count=10), uvs)
    found = piece_strands.mesh_strands(
        mesh, FLOOR, MeshStrandSettings(strand_count=10), uvs, alpha_at=lambda places: np.ones(len(places))
    )
    np.testing.assert_array_equal(found.points, plain.points)
    np.testing.assert_array_equal(found.radii, plain.radii)


def test_a_transparent_texture_is_one_sentence():
    with pytest.raises(HairError, match="transparent at all strands"):
        strands_of(np.zeros((256, 256)), strand_count=10)


def test_strands_keep_their_order_and_their_part_of_the_width(rng):
    """Between rows, strands never change places, and together they are as wide as the opaque cells."""
    opaque = (rng.random((5, 1, 64)) > 0.0) & np.ones((5, 24, 1), bool)
    for number in range(5):  # an opening that grows, closes and moves
        for row in range(4, 20):
            start = 20 + number + int(4 * np.sin(row))
            opaque[number, row, start : start + min(row - 3, 20 - row)] = False
    cards, across = np.repeat(np.arange(5), 50), np.tile((np.arange(50) + 0.5) / 50, 5)
    found = alpha_paths.traced(opaque, np.full((5, 23), 8.0), cards, across)
    assert (found.first == 0).all()
    for number in range(5):
        rows = cards == number
        for row in range(24):
            is_there = rows & (found.last >= row)
            assert (np.diff(found.places[is_there, row]) > 0.0).all()
            assert opaque[number, row, (found.places[is_there, row] * 64).astype(int)].all()
        is_there = rows & (found.last == 23)
        np.testing.assert_allclose(found.widths[is_there, -1].sum(), opaque[number, -1].mean(), rtol=0.05)


def test_strands_end_where_a_part_ends_abruptly():
    """A step in the border ends the strands behind it; the others go straight on."""
    opaque = np.ones((1, 16, 64), bool)
    opaque[0, 8:, 32:] = False
    across = (np.arange(64) + 0.5) / 64
    found = alpha_paths.traced(opaque, np.full((1, 15), 1.0), np.zeros(64, int), across)
    assert (found.last[:32] == 15).all() and (found.last[33:] == 7).all()
    np.testing.assert_allclose(found.places[:32, -1], across[:32], atol=1.5 / 64)
