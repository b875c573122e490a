# SPDX-License-Identifier: GPL-3.0-or-later
"""A strand has the same bits in any group, although kernels branch if any strand of a group needs it."""

import pytest

from tests.support.strands import strand_groups

GROUPS = strand_groups.all_groups()


@pytest.mark.parametrize("name", GROUPS)
def test_a_strand_is_the_same_in_groups_of_any_size_and_order(name):
    assert list(GROUPS[name].different()) == []
