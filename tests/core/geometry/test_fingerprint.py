# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints detect moved points."""

import os

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.fingerprint import fingerprint


@pytest.fixture
def points(rng):
    return rng.normal(size=(500, 41, 3)).astype(np.float32)


def test_the_same_points_leave_the_same_fingerprint(points, monkeypatch):
    found = fingerprint(points)
    assert found == fingerprint(points.copy()) == fingerprint(points.reshape(-1, 3))
    monkeypatch.setattr(os, "process_cpu_count", lambda: 7)
    assert found == fingerprint(points)


@pytest.mark.parametrize("count", [0, 1, 33, 120, 500])
def test_copied_points_are_the_points(points, count):
    """The fingerprint of copied points is that of the points, and nothing beside the copy is written."""
    there = np.full(3 * 41 * 500 + 7, np.nan, np.float32)
    copies = there[3 : 3 + 3 * 41 * count]
    assert fingerprint(points[:count], copies) == fingerprint(points[:count])
    np.testing.assert_array_equal(copies, points[:count].ravel())
    assert np.isnan(there).sum() == len(there) - len(copies)
    with pytest.raises(HairError):
        fingerprint(points, copies[:-1])


CHANGES = {
    "one bit": lambda p, i: np.nextafter(p[i], np.float32(9.0)),
    "moved": lambda p, i: p[i] + np.float32(0.01),
    "mirrored": lambda p, i: p[i] * np.float32([-1.0, 1.0, 1.0]),
    "turned around": lambda p, i: -p[i],
    "reversed": lambda p, i: p[i][..., ::-1, :],
    "another strand's": lambda p, i: p[(i + 1) if isinstance(i, int) else slice(None, None, -1)],
    "zero": lambda p, i: 0.0 * p[i],
}


@pytest.mark.parametrize("chosen", [3, slice(None)], ids=["one strand", "all"])
@pytest.mark.parametrize("change", CHANGES)
def test_any_change_is_seen(points, change, chosen):
    changed = points.copy()
    changed[chosen] = CHANGES[change](points, chosen)
    assert fingerprint(changed) != fingerprint(points)


def test_every_word_counts(points):
    """Every word changes the fingerprint, by a low or a high bit at any place."""
    words = points[:120].copy().view(np.uint32).reshape(-1)
    found = {fingerprint(points[:120])}
    for place in range(0, len(words), 97):
        for bit in (0, 15, 31):
            words[place] ^= np.uint32(1 << bit)
            found.add(fingerprint(words.view(np.float32).reshape(-1, 3)))
            words[place] ^= np.uint32(1 << bit)
    assert len(found) == 1 + 3 * len(range(0, len(words), 97))


def test_more_or_fewer_points_differ(points):
    zeros = np.zeros_like(points)
    assert len({fingerprint(zeros[:count]) for count in (0, 1, 2, 100, 400, 500)}) == 6
