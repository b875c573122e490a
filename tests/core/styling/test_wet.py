# SPDX-License-Identifier: GPL-3.0-or-later
"""Wet has no effect at zero, and wetter hair clings, joins and swells more."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.styling import clump, curl, frizz, program, wet
from tests.support.strands.styled import head

LOCK = wet.Settings(lock=0.03)


@pytest.fixture(scope="module")
def hair():
    return head(500, 60)


def test_wetness_zero_is_dry(hair):
    """Wetness zero is dry: the bits are those of dry hair, whatever styles come before."""
    np.testing.assert_array_equal(hair.styled(replace(LOCK, amount=0.0)), hair.plain)
    others = curl.Settings(), frizz.Settings()
    np.testing.assert_array_equal(hair.styled(*others, replace(LOCK, amount=0.0)), hair.styled(*others))


def test_hardly_wet_is_nearly_dry(hair):
    """Hardly wet hair is nearly dry, as locks join by the square root of the wetness."""
    moved = np.linalg.norm(hair.styled(replace(LOCK, amount=1e-6)) - hair.plain, axis=2)
    assert np.median(moved[:, -1]) < 2e-4


def test_the_wetter_the_thinner_the_locks(hair):
    label = hair.bound(LOCK).data.members.numpy()[0]
    spreads = []
    for amount in (0.05, 0.25, 0.5, 0.75, 1.0):
        points = hair.styled(replace(LOCK, amount=amount))
        tips = [points[label == lock, 30] for lock in np.unique(label) if (label == lock).sum() > 3]
        spreads.append(np.median([np.linalg.norm(tip - np.median(tip, axis=0), axis=1).mean() for tip in tips]))
    assert np.all(np.diff(spreads) < 0.0)
    assert spreads[-1] < 0.6 * spreads[0]


def test_small_locks_form_first(hair):
    """At a tenth of the wetness small locks have gathered by a third or more, and large locks hardly."""
    made = program.strand_steps([replace(LOCK, amount=0.1)], {})
    large, small = (step.amount for step in made if step.level is not None and step.kind == clump.STEP)
    assert large < 0.05 and small > 0.25


def test_water_straightens_curls(hair):
    """Water straightens curls more with more wetness: the sum of angles between segments falls."""

    def bending(points):
        segments = np.diff(points.astype(np.float64), axis=1)
        segments /= np.linalg.norm(segments, axis=2, keepdims=True)
        return np.median(np.arccos(np.clip((segments[:, 1:] * segments[:, :-1]).sum(axis=2), -1.0, 1.0)).sum(axis=1))

    curls = curl.Settings(radius=0.004, pitch=0.03)
    found = [bending(hair.styled(curls, replace(LOCK, amount=amount))) for amount in (0.0, 0.5, 1.0)]
    assert found[2] < found[1] < found[0]


def test_water_swells_and_shading_knows_the_wettest():
    styles = [wet.Settings(amount=0.4, swelling=0.5), curl.Settings(), wet.Settings(amount=0.2, swelling=0.5)]
    assert program.radius_factor(styles) == pytest.approx(1.2 * 1.1)
    assert program.wetness(styles) == 0.4
    off = [replace(settings, is_on=False) for settings in styles]
    assert program.radius_factor(off) == 1.0 and program.wetness(off) == 0.0
