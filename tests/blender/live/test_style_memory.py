# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles that change: what is held in memory is that of the present ones."""

import gc
import resource
from pathlib import Path

import bpy
import pytest
import warp as wp

from hair_addon import api
from hair_addon.blender.groom import bindings
from hair_addon.core.params import Settings, declared
from hair_addon.core.styling.kinds import KINDS, OFFERS

FEW, MANY = 3, 6
LONG = 1000
ROOM = 1.05  # between the memory after few changes, and after a thousand


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


def resident():
    """Memory of this process [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def grown(change):
    """(things, memory) after `LONG` changes, over those after a hundredth of them; change(number): one of them."""
    seen = []
    for number in range(LONG):
        change(number)
        if number + 1 in (LONG // 100, LONG):
            seen.append((things_alive(), resident()))
    return tuple(after / before for before, after in zip(*seen, strict=True))


@pytest.mark.long
@pytest.mark.parametrize("offer", {offer.kind: name for name, offer in OFFERS.items()}.values())
def test_memory_stays_as_it_is_in_a_thousand_changes_and_frames(hair, offer):
    """Of all numbers of a style, dragged and keyed, with 300 strands."""
    hair = hair.data
    hair.vellus.hair.strand_count = 300
    given = api.add_style(hair, offer)
    item = hair.vellus.styles[0]
    group = getattr(item, item.kind.lower())

    def drag(number):
        for name, value in changed(item.kind, given, number % 100 + number / LONG).items():
            setattr(group, name, int(value) if isinstance(getattr(group, name), int) else value)
        bpy.context.view_layer.update()

    def play(number):
        bpy.context.scene.frame_set(number + 1)

    found = {"dragged": grown(drag)}
    for frame in (1, LONG):
        for name, value in changed(item.kind, given, 0.1 * frame).items():
            setattr(group, name, int(value) if isinstance(getattr(group, name), int) else value)
            if group.bl_rna.properties[name].is_animatable:
                group.keyframe_insert(name, frame=frame)
    found["keyed"] = grown(play)
    print(offer, found)
    assert hair.vellus.status == "" and bindings.of(hair).styles.styling is not None
    assert all(things <= 1.0 + 1e-3 and memory <= ROOM for things, memory in found.values()), found
