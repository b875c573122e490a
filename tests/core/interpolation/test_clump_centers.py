# SPDX-License-Identifier: GPL-3.0-or-later
"""The strand nearest to each guide is that of brute force."""

import numpy as np
import pytest

from hair_addon.core.interpolation.clump_centers import clump_centers


@pytest.mark.parametrize("guide_count", [1, 7, 300])
def test_a_leader_is_the_nearest_of_its_guides_own(rng, guide_count):
    guide_roots, roots = (rng.random((count, 3), dtype=np.float32) for count in (guide_count, 200))
    guide_index = rng.integers(0, guide_count, 200)
    found = clump_centers(guide_index, roots, guide_roots)
    for strand, leader in enumerate(found):
        own = np.flatnonzero(guide_index == guide_index[strand])
        apart = np.linalg.norm(roots[own] - guide_roots[guide_index[strand]], axis=1)
        assert leader == own[apart.argmin()]
    np.testing.assert_array_equal(found[found], found)


def test_of_strands_in_one_place_the_first_leads():
    roots = np.zeros((4, 3), np.float32)
    np.testing.assert_array_equal(clump_centers(np.array([1, 0, 1, 0]), roots, roots[:2]), [0, 1, 0, 1])
