# SPDX-License-Identifier: GPL-3.0-or-later
"""Random numbers are even and independent, and equal the kernel's."""

import numpy as np
import pytest

from hair_addon.core.styling import trim
from hair_addon.core.styling.random_numbers import LENGTH, PURPOSES, random_numbers
from tests.support.dynamics.stepped import stepped, straight_strands


@pytest.fixture
def identities(rng):
    return rng.integers(-(2**31), 2**31, 20_000).astype(np.int32)


def test_they_are_even(identities):
    found = random_numbers(identities, 3, LENGTH)
    assert found.dtype == np.float32 and found.min() >= 0.0 and found.max() < 1.0
    counts = np.histogram(found, 50, (0.0, 1.0))[0]
    assert ((counts - 400.0) ** 2 / 400.0).sum() < 100.0  # chi-square of 49 degrees of freedom: beyond in 2e-5


def test_identities_in_a_row_are_as_random(identities):
    found = random_numbers(np.arange(20_000), 0, LENGTH)
    assert abs(np.corrcoef(found[:-1], found[1:])[0, 1]) < 0.03
    assert abs(found.mean() - 0.5) < 0.01


def test_seeds_and_purposes_are_independent(identities):
    given = [(seed, purpose) for seed in (0, 1, 2**31 - 1) for purpose in PURPOSES.values()]
    correlation = np.corrcoef([random_numbers(identities, *each) for each in given])
    assert np.abs(correlation - np.eye(len(given))).max() < 0.04


def test_they_are_the_identity_s_alone(identities):
    found = random_numbers(identities, 5, LENGTH)
    order = np.argsort(identities)
    np.testing.assert_array_equal(random_numbers(identities[order], 5, LENGTH), found[order])


@pytest.mark.parametrize("seed", [0, 7, 2**31 - 1])
def test_the_kernel_has_the_same(identities, seed):
    """The kernel has the same random numbers, read from strands that Trim scales by them."""
    some = identities[:500]
    settings = trim.Settings(random=1.0, method="SCALE", seed=seed)
    points = stepped(straight_strands(500, 1.0, 2, 0.0), settings, identities=some)
    np.testing.assert_allclose(1.0 - points[:, -1, 2], random_numbers(some, seed, LENGTH), atol=1e-6)
