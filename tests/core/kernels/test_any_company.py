# SPDX-License-Identifier: GPL-3.0-or-later
"""A strand is the same to the last bit in any company: kernels take groups of strands, and branch for any of them."""

import pytest

from tests.support.strands import company

COMPANIES = company.companies()


@pytest.mark.parametrize("name", COMPANIES)
def test_a_strand_is_the_same_in_companies_of_any_size_and_order(name):
    assert list(COMPANIES[name].unlike()) == []
