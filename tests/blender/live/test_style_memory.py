# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles that change: what is held in memory is that of the present ones."""

import gc

import bpy
import pytest
import warp as wp

from hair_addon import api
from hair_addon.blender.groom import bindings
from hair_addon.core.params import Settings, declared
from hair_addon.core.styling.kinds import KINDS, OFFERS

FEW, MANY = 3, 6


@pytest.fixture(scope="module", autouse=True)
def earlier_things_are_left_out():
    """All that Python held before, a million things by the end of all tests, is not looked through again each time."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


def things_alive():
    """How many of our objects and of Warp's arrays Python holds: what is large hangs on them, but not on settings."""
    gc.collect()
    kinds = (type(each) for each in gc.get_objects())
    ours = (k for k in kinds if k is wp.array or str(k.__module__).startswith("hair_addon"))
    return sum(not issubclass(kind, Settings) for kind in ours)


def changed(kind, given, step):
    """{name: value} of the numbers of a kind of style, other ones in each step, near the given ones."""
    values = {}
    for name, default, details in declared(KINDS[kind]):
        if isinstance(default, float):
            first = getattr(given, name)
            values[name] = first + (min(details.high, 2.0 * first or 1.0) - first) * 0.01 * step
        elif isinstance(default, int) and not isinstance(default, bool) and details.high > 100:
            values[name] = step  # of seeds
    return values


@pytest.mark.parametrize("offer", {offer.kind: name for name, offer in OFFERS.items()}.values())
def test_changes_of_a_style_keep_nothing_of_those_before(hair, offer):
    hair = hair.data
    hair.vellus.hair.strand_count = 40
    given = api.add_style(hair, offer)
    bpy.context.view_layer.update()
    item = hair.vellus.styles[0]
    group = getattr(item, item.kind.lower())
    counts = {}
    for step in range(MANY):
        for name, value in changed(item.kind, given, step).items():
            setattr(group, name, value)
        bpy.context.view_layer.update()
        if step in (FEW, MANY - 1):
            counts[step] = things_alive()
    assert hair.vellus.status == "" and bindings.of(hair).styles.styling is not None
    assert counts[MANY - 1] <= counts[FEW]
