# SPDX-License-Identifier: GPL-3.0-or-later
"""Card pictures in an atlas do not overlap and have one scale, and UV coordinates are inside the pictures."""

import numpy as np
import pytest

from hair_addon.core.cards import atlas
from hair_addon.core.cards.card_settings import CardSettings
from hair_addon.core.cards.outlines import Outlines
from hair_addon.core.errors import HairError
from tests.core.cards.conftest import COUNT, SEGMENTS, SIZE


def boxes(places):
    return np.concatenate([places.corners, places.corners + places.sizes], axis=1)


def require_apart(places, size):
    """Assert that pictures are in the texture, two texels from its border and four from each other."""
    low, high = boxes(places)[:, :2], boxes(places)[:, 2:]
    assert low.min() >= 2.0 / size - 1e-9 and high.max() <= 1.0 - 2.0 / size + 1e-9
    gaps = np.maximum(low[:, None] - high[None], low[None] - high[:, None]).max(axis=-1)
    np.fill_diagonal(gaps, 1.0)
    assert gaps.min() >= 4.0 / size - 1e-9


def test_pictures_are_apart_and_fill_the_texture(carded):
    require_apart(carded.atlas, SIZE)
    assert carded.atlas.sizes.prod(axis=1).sum() > 0.5


def test_uv_coordinates_lie_in_their_picture_and_areas_are_those_of_the_cards(carded):
    uvs = carded.mesh.uvs.reshape(COUNT, -1, 2)
    found = boxes(carded.atlas)[carded.atlas.picture_of]
    assert (uvs >= found[:, None, :2] - 1e-6).all() and (uvs <= found[:, None, 2:] + 1e-6).all()
    quads = carded.mesh.uvs.reshape(COUNT, SEGMENTS, 4, 2).astype(np.float64)
    first, second = quads[:, :, 2] - quads[:, :, 0], quads[:, :, 3] - quads[:, :, 1]
    areas = 0.5 * (first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    assert (areas > 0.0).all()
    np.testing.assert_allclose(areas.sum(axis=1), carded.outlines.areas * carded.atlas.scale**2, rtol=1e-3)


def test_v_grows_from_root_to_tip(carded):
    v = carded.mesh.uvs.reshape(COUNT, SEGMENTS, 4, 2)[..., 1]
    assert (v[:, :, 0] == v[:, :, 1]).all() and (v[:, :, 2] > v[:, :, 1]).all() and (np.diff(v[:, :, 0]) > 0.0).all()


def test_strands_are_drawn_where_their_card_shows_them(carded):
    strands, places, radii = carded.atlas.placed(carded.flat, carded.radii, carded.labels, carded.outlines.boxes)
    np.testing.assert_array_equal(strands, np.arange(len(carded.points)))
    found = boxes(carded.atlas)[carded.atlas.picture_of[carded.labels]]
    reach = radii.max()
    assert (places[..., :2] >= found[:, None, :2] + reach - 1e-6).all()
    assert (places[..., :2] <= found[:, None, 2:] - reach + 1e-6).all()
    lengths = np.linalg.norm(np.diff(carded.flat, axis=1), axis=-1)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(places, axis=1), axis=-1), lengths * carded.atlas.scale, rtol=1e-2, atol=1e-6
    )


@pytest.mark.parametrize("count", [1, 6, COUNT])
def test_cards_share_so_many_pictures(carded, count):
    shared = atlas.atlas(carded.outlines, np.bincount(carded.labels), count, SIZE)
    require_apart(shared, SIZE)
    assert len(shared.shown) == count and sorted(set(shared.picture_of)) == list(range(count))
    np.testing.assert_array_equal(shared.picture_of[shared.shown], np.arange(count))
    assert shared.scale >= carded.atlas.scale
    uvs, found = shared.uvs(carded.outlines), boxes(shared)[shared.picture_of][:, None, None]
    assert (uvs >= found[..., :2] - 1e-9).all() and (uvs <= found[..., 2:] + 1e-9).all()


def test_rectangles_of_any_shape_find_a_place(rng):
    for count in (1, 2, 33, 500):
        sizes = np.exp(rng.normal(0.0, 1.5, (count, 2)))
        along = np.stack([np.zeros(count), sizes[:, 1]], axis=1)
        high = np.broadcast_to(sizes[:, :1], (count, 2))
        made = atlas.atlas(Outlines(along, np.zeros((count, 2)), high), np.ones(count), 0, 4096)
        require_apart(made, 4096)
        np.testing.assert_allclose(made.sizes, sizes * made.scale, rtol=1e-12)


def test_pictures_without_texels_are_refused():
    many = 20_000
    along, ones = np.tile([0.0, 1.0], (many, 1)), np.ones((many, 2))
    with pytest.raises(HairError, match=r"do not fit|Too many"):
        atlas.atlas(Outlines(along, 0.0 * ones, 0.1 * ones), np.ones(many), 0, 256)


def test_levels_halve_and_what_is_too_large_is_refused():
    levels = CardSettings(card_count=100, segment_count=8, level_count=5, texture_size=1024).levels(10**6)
    assert [(level.card_count, level.segment_count, level.texture_size) for level in levels] == [
        (100, 8, 1024),
        (50, 4, 512),
        (25, 2, 256),
        (12, 1, 128),
        (6, 1, 128),
    ]
    assert [level.triangle_count for level in levels] == [1600, 400, 100, 24, 12]
    assert CardSettings(card_count=100).levels(30)[0].card_count == 30
    with pytest.raises(HairError, match="use fewer cards"):
        CardSettings(card_count=50_000, segment_count=64).require_size(10**6)
