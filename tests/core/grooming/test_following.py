# SPDX-License-Identifier: GPL-3.0-or-later
"""Every stage after the weighted sum applies to strands in all kinds of updates."""

import numpy as np
import pytest

from hair_addon.core.geometry import strands
from hair_addon.core.grooming import following, groom, style_binding
from hair_addon.core.interpolation import hair_binding
from hair_addon.core.styling import clump, curl
from tests.support.devices import DEVICE


@pytest.fixture
def bound(head, scalp):
    """Return (guides, binding) of 2,000 strands."""
    guides = groom.distribute_guides(head, groom.GuideSettings(guide_count=100), density=scalp, device=DEVICE)
    settings = groom.HairSettings(strand_count=2000)
    return guides, groom.bind_hair(head, guides, settings, density=scalp, device=DEVICE)


@pytest.fixture
def styling(head, scalp, bound):
    """Return the styling of the same strands by locks that curl."""
    guides, binding = bound
    settings = groom.HairSettings(strand_count=2000)
    trees = style_binding.clump_trees(head, guides.roots, settings, density=scalp, device=DEVICE)
    return style_binding.bind_styles(binding, guides, settings, [clump.Settings(), curl.Settings(seed=1)], trees)


def test_a_style_is_in_strands_of_every_update(bound, styling):
    guides, binding = bound
    weights = following.weights_now(binding, guides)
    plain = following.follow_guides(binding, guides).numpy()
    whole = following.follow_guides(binding, guides, styling).numpy()
    assert np.abs(whole - plain).max() > 0.01
    np.testing.assert_array_equal(whole[:, 0], plain[:, 0])
    np.testing.assert_allclose(strands.lengths(whole), strands.lengths(plain), rtol=1e-4)
    grown = following.growing_points(binding, guides, weights, styling=styling).result()
    np.testing.assert_array_equal(grown, whole)
    chosen = np.arange(3, 2000, 7)
    some, shares = following.follow_some(binding, guides, chosen, styling=styling)
    np.testing.assert_allclose(some, whole[chosen], atol=1e-6)
    np.testing.assert_array_equal(shares, weights.weights.numpy()[chosen])


def test_identities_and_leaders_stay_while_guides_are_combed_and_weighed_again(bound):
    _guides, binding = bound
    again = hair_binding.reweighed(binding, groom.HairSettings(strand_count=2000, length_limit=1.5))
    np.testing.assert_array_equal(again.identities, binding.identities)
    np.testing.assert_array_equal(again.leaders, binding.leaders)
    first = binding.guide_weights.indices.numpy()[:, 0]
    np.testing.assert_array_equal(first[binding.leaders], first)
    assert len(np.unique(binding.identities[0])) == 2000


def test_what_was_combed_is_told_from_what_is_rooted_elsewhere(bound):
    guides, _binding = bound
    points = guides.numpy().copy()
    points[[3, 7], 1:] += 0.01
    np.testing.assert_array_equal(following.combed(guides.moved(points), guides), [3, 7])
    slid = guides.roots[np.roll(np.arange(100), 1)]
    assert following.combed(strands.from_numpy(points, slid, DEVICE), guides) is None
    assert following.combed(strands.from_numpy(points[:50], guides.roots[:50], DEVICE), guides) is None
