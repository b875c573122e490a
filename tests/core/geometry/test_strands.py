# SPDX-License-Identifier: GPL-3.0-or-later
"""The offsets of strands add up to their points, and lengths are those of polylines."""

import numpy as np
import pytest

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


def test_ragged_polylines_have_the_lengths_of_each(rng):
    polylines = [rng.normal(size=(count, 3)) for count in (2, 1, 7, 30)]
    starts = strands.curve_offsets([len(polyline) for polyline in polylines])
    alone = [strands.lengths(polyline[None])[0] for polyline in polylines]
    np.testing.assert_allclose(strands.ragged_lengths(np.concatenate(polylines), starts), alone, atol=1e-12)


def test_lengths_of_a_straight_strand():
    points = np.linspace(0.0, 1.0, 41)[None, :, None] * np.array([3.0, 0.0, 4.0])
    np.testing.assert_allclose(strands.lengths(points), 5.0)
    np.testing.assert_allclose(strands.segment_lengths(points), 5.0 / 40.0)
