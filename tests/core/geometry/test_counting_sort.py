# SPDX-License-Identifier: GPL-3.0-or-later
"""Orders found by counting equal those of a stable sort."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.search import counting_sort


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 3000),
    group_count=st.sampled_from([1, 2, 50, 4000, counting_sort.MOST_GROUPS + 1]),  # the last ones are compared
)
def test_groups_come_in_order_and_items_of_each_by_their_index(seed, count, group_count):
    groups = np.random.default_rng(seed).integers(0, group_count, count, np.int32)
    order, bounds = counting_sort.grouped(groups, group_count)
    np.testing.assert_array_equal(order, np.argsort(groups, kind="stable"))
    assert order.dtype == bounds.dtype == np.int32
    _groups, firsts = np.unique(groups[order], return_index=True)
    np.testing.assert_array_equal(bounds, [*firsts, count])


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 3000), levels=st.sampled_from([0, 1, 7]))
def test_numbers_rise_and_equal_ones_come_by_their_index(seed, count, levels):
    """Numbers are in ascending order, and equal ones in the order of their indices."""
    numbers = np.random.default_rng(seed).random(count)
    numbers = np.floor(numbers * levels) / levels if levels else numbers
    np.testing.assert_array_equal(counting_sort.rising(numbers), np.argsort(numbers, kind="stable"))


def test_many_numbers_rise_on_all_cores(rng):
    numbers = rng.random(300_000)
    np.testing.assert_array_equal(counting_sort.rising(numbers), np.argsort(numbers, kind="stable"))


def test_neither_needs_items():
    order, bounds = counting_sort.grouped(np.empty(0, np.int32), 5)
    assert len(order) == 0 and bounds.tolist() == [0]
    assert len(counting_sort.rising(np.empty(0))) == 0


@pytest.mark.parametrize("outside", [-1, 5])
def test_groups_that_there_are_not_are_refused(outside):
    with pytest.raises(HairError, match="groups"):
        counting_sort.grouped(np.int32([0, outside, 2]), 5)
