# SPDX-License-Identifier: GPL-3.0-or-later
"""The offsets of strands add up to their points, and resampling keeps their line."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import strands
from hair_addon.core.geometry.mesh import SurfacePoints


def roots_of(count):
    return SurfacePoints(np.zeros(count, np.int32), np.tile(np.float32([1, 0, 0]), (count, 1)))


def test_offsets_add_up_to_the_points(rng):
    points = rng.normal(size=(7, 41, 3))
    np.testing.assert_allclose(np.cumsum(strands.offsets(points), axis=1), points)  # Eq. 8 undoes Eq. 7


def test_numpy_in_is_numpy_out(rng, device):
    points = rng.random((5, 9, 3), dtype=np.float32)
    made = strands.from_numpy(points, roots_of(5), device)
    assert (len(made), made.point_count) == (5, 9)
    np.testing.assert_array_equal(made.numpy(), points)


def test_points_and_roots_must_agree(rng, device):
    with pytest.raises(ValueError, match="4, P, 3"):
        strands.from_numpy(rng.random((5, 9, 3)), roots_of(4), device)


@given(seed=st.integers(0, 2**32 - 1), counts=st.lists(st.integers(1, 12), min_size=1, max_size=6))
def test_resampled_points_are_evenly_spaced_along_their_own_polyline(seed, counts):
    generator = np.random.default_rng(seed)
    polylines = [generator.normal(size=(count, 3)) for count in counts]
    starts = np.concatenate([[0], np.cumsum(counts)])
    resampled = strands.resample(np.concatenate(polylines), starts, 17)
    for line, points in zip(polylines, resampled, strict=True):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        wanted = np.linspace(0.0, along[-1], 17)
        expected = np.stack([np.interp(wanted, along, axis) for axis in line.T], axis=1)
        np.testing.assert_allclose(points, expected, atol=1e-5)


def test_resampling_an_even_polyline_returns_it(rng):
    line = np.cumsum(np.tile([0.1, 0.0, 0.0], (41, 1)), axis=0).astype(np.float32)
    np.testing.assert_allclose(strands.resample(line, [0, 41], 41)[0], line, atol=1e-6)


def test_repeated_points_are_passed_over():
    line = np.float32([(0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0), (2, 0, 0)])
    np.testing.assert_allclose(strands.resample(line, [0, 7], 5)[0, :, 0], [0.0, 0.5, 1.0, 1.5, 2.0])


def test_a_single_point_is_repeated():
    resampled = strands.resample(np.float32([(1, 2, 3), (4, 5, 6)]), [0, 1, 2], 4)
    np.testing.assert_array_equal(resampled, np.repeat(np.float32([[(1, 2, 3)], [(4, 5, 6)]]), 4, axis=1))


def test_ragged_polylines_have_the_lengths_of_each(rng):
    polylines = [rng.normal(size=(count, 3)) for count in (2, 1, 7, 30)]
    starts = strands.curve_offsets([len(polyline) for polyline in polylines])
    alone = [strands.lengths(polyline[None])[0] for polyline in polylines]
    np.testing.assert_allclose(strands.ragged_lengths(np.concatenate(polylines), starts), alone, atol=1e-12)


def test_lengths_of_a_straight_strand():
    points = np.linspace(0.0, 1.0, 41)[None, :, None] * np.array([3.0, 0.0, 4.0])
    np.testing.assert_allclose(strands.lengths(points), 5.0)
    np.testing.assert_allclose(strands.segment_lengths(points), 5.0 / 40.0)


@pytest.mark.parametrize(
    ("points", "starts", "sentence"),
    [
        (np.zeros((2, 3)), [0, 0, 2], "1 curves have no points"),
        (np.full((2, 3), np.nan), [0, 2], "non-finite"),
    ],
)
def test_refused_curves(points, starts, sentence):
    with pytest.raises(HairError, match=sentence):
        strands.resample(points, starts, 5)
