# SPDX-License-Identifier: GPL-3.0-or-later
"""Packed strands round points relative to each strand, and their bits survive in textures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import packed_strands
from tests.support.pictures import drawn_strands


def packed(points):
    texels = np.empty((len(points), packed_strands.texel_count(points.shape[1]), 2), np.float32)
    packed_strands.pack(points, texels)
    return texels


def strands(seed, size, place, flat, counts=(50, 9)):
    """Return (S, P, 3) strands of a size [m] at a distance from the origin, without extent along some axes."""
    generator = np.random.default_rng(seed)
    roots = place * generator.normal(size=(counts[0], 1, 3))
    steps = size * generator.normal(size=(*counts, 3)) * ~np.array(flat)
    steps[:, 0] = 0.0
    return (roots + np.cumsum(steps, axis=1)).astype(np.float32)


SIZES = st.sampled_from([0.0, 1e-12, 2e-5, 0.01, 1.0, 1e6, 1e20])


@given(
    seed=st.integers(0, 2**32 - 1),
    size=SIZES,
    place=st.sampled_from([0.0, 1.0, 1e4]),
    flat=st.tuples(*[st.booleans()] * 3),
)
def test_points_are_within_a_part_of_their_strand(seed, size, place, flat):
    """Points are within 2^-20 of their strand's greatest offset beside any other strands; bounds are exact."""
    points = strands(seed, size, place, flat)
    points[0, 1:] = points[0, :1]  # without length
    points[1, 1:] = points[1, :1] + 1000.0 * (points[1, 1:] - points[1, :1])
    texels = np.empty((50, packed_strands.texel_count(9), 2), np.float32)
    bounds = packed_strands.pack(points, texels)
    np.testing.assert_array_equal(bounds, [points.min(axis=(0, 1)), points.max(axis=(0, 1))])
    found = packed_strands.unpack(texels)
    assert drawn_strands.are_drawn(found, points)
    np.testing.assert_array_equal(found[:, 0], points[:, 0])
    np.testing.assert_array_equal(found[0], points[0])


def test_what_is_packed_again_stays():
    """A strand that is unpacked and packed again has the same bits."""
    points = packed_strands.unpack(packed(strands(1, 0.01, 0.0, (False,) * 3)))
    again = packed_strands.unpack(packed(points))
    assert np.abs(again - points).max() <= 2.0**-22 * np.abs(points).max()


def test_texels_are_normal_numbers():
    """Texels are normal numbers, as textures may lose the bits of denormal and non-finite numbers."""
    texels = packed(strands(2, 0.1, 1.0, (False,) * 3, (2000, 41)))[:, packed_strands.HEAD_TEXELS :]
    assert np.isfinite(texels).all()
    assert (np.abs(texels) >= np.finfo(np.float32).tiny).all()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_strand_that_is_not_finite_spoils_no_other(value):
    points = strands(3, 0.1, 1.0, (False,) * 3)
    points[7, 4, 1] = value
    found = packed_strands.unpack(packed(points))
    others = np.arange(len(points)) != 7
    assert not np.isfinite(found[7, 1:]).any()
    assert drawn_strands.are_drawn(found[others], points[others])


def test_another_number_of_texels_is_refused():
    points = strands(4, 0.1, 1.0, (False,) * 3)
    with pytest.raises(HairError, match="texels"):
        packed_strands.pack(points, np.empty((50, 9, 2), np.float32))
