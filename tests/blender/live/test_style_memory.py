# SPDX-License-Identifier: GPL-3.0-or-later
"""Changing styles does not accumulate memory."""

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
from tests.support import remembered
from tests.support.pairs import share_of
from tests.support.reading import points

FEW, MANY, LAST = 3, 10, 3
HELD = 2  # arrays that a thread may hold that has just ended; they are freed with the next change
LONG = 1000
ROOM = 1.05  # between the memory after few changes, and after a thousand


@pytest.fixture(scope="module", autouse=True)
def earlier_things_are_left_out():
    """Freeze the objects that Python already holds, so that garbage collection skips them each time."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture(autouse=True)
def placed_anew(functions_remember, monkeypatch):
    """Use the add-on's own cache of roots, as tests remember all earlier roots."""
    remembered.forget(monkeypatch)


def things_alive():
    """Return the number of the add-on's objects and of Warp's arrays in Python, which refer to all large data."""
    gc.collect()
    kinds = (type(each) for each in gc.get_objects())
    ours = (k for k in kinds if k is wp.array or str(k.__module__).startswith("hair_addon"))
    return sum(not issubclass(kind, Settings) for kind in ours)


def changed(kind, given, step):
    """Return {name: value} of the numbers of a style, near the given numbers and different in each step."""
    values = {}
    for name, default, details in declared(KINDS[kind]):
        if isinstance(default, float):
            first = getattr(given, name)
            values[name] = first + (min(details.high, 2.0 * first or 1.0) - first) * 0.01 * step
        elif isinstance(default, int) and not isinstance(default, bool) and details.high > 100:
            values[name] = step  # of seeds
    return values


class Changing:
    """Hair with few strands and a style whose numbers all change in each step by dragging, keys or drivers."""

    def __init__(self, hair, offer, strand_count):
        self.object, self.hair = hair, hair.data
        self.hair.vellus.hair.strand_count = strand_count
        self.given = api.add_style(self.hair, offer)
        self.item = self.hair.vellus.styles[0]
        self.group = getattr(self.item, self.item.kind.lower())
        bpy.context.view_layer.update()

    def _set(self, step):
        for name, value in changed(self.item.kind, self.given, step).items():
            setattr(self.group, name, int(value) if isinstance(getattr(self.group, name), int) else value)

    def _animated(self):
        names = changed(self.item.kind, self.given, 0)
        return [name for name in names if self.group.bl_rna.properties[name].is_animatable]

    def dragged(self):
        """Return a function that sets the numbers of a step."""

        def drag(number):
            self._set(number % 100 + number / LONG)
            bpy.context.view_layer.update()

        return drag

    def keyed(self):
        for frame in (1, LONG):
            self._set(0.1 * frame)
            for name in self._animated():
                self.group.keyframe_insert(name, frame=frame)
        return self._play

    def driven(self):
        self.hair.animation_data_clear()
        first, second = (changed(self.item.kind, self.given, step) for step in (0, 1))
        for name in self._animated():
            curve = self.group.driver_add(name)
            curve.driver.expression = f"{first[name]} + {second[name] - first[name]} * fmod(frame, 100)"
        return self._play

    @staticmethod
    def _play(number):
        bpy.context.scene.frame_set(number + 2)

    def assert_shown(self):
        """Assert that the style has an effect and the hair has no error."""
        assert self.hair.vellus.status == "" and bindings.of(self.hair).styles.styling is not None


OFFER_OF_KINDS = {offer.kind: name for name, offer in OFFERS.items()}.values()


@pytest.mark.parametrize("offer", share_of(OFFER_OF_KINDS, 4))
def test_changes_of_a_style_keep_nothing_of_those_before(hair, offer):
    changing = Changing(hair, offer, 40)
    for begin in (changing.dragged, changing.keyed, changing.driven):
        change, counts, shown = begin(), [], set()
        for step in range(MANY):
            change(step)
            shown.add(points(changing.object).tobytes())
            counts.append(things_alive())
        assert len(shown) == MANY, begin.__name__
        # A thing kept by each change makes the counts rise in each step; threads make single counts rise or fall.
        first, last = max(counts[: FEW + 1]), min(counts[-LAST:])
        assert last <= first + HELD < first + MANY - LAST - FEW, begin.__name__
    changing.assert_shown()


def resident():
    """Return the memory of this process [bytes]."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def grown(change):
    """Return (objects, memory) after a hundredth of `LONG` changes and after all; change(number): makes a change."""
    seen = []
    for number in range(LONG):
        change(number)
        if number in (LONG // 100 - 1, LONG - 1):
            seen.append((things_alive(), resident()))
    return seen


@pytest.mark.long
@pytest.mark.parametrize("offer", OFFER_OF_KINDS)
def test_memory_stays_as_it_is_in_a_thousand_changes_and_frames(hair, offer):
    """Memory stays constant while each number of a style of 300 strands is dragged, keyed and driven."""
    changing = Changing(hair, offer, 300)
    for begin in (changing.dragged, changing.keyed, changing.driven):
        (few_things, few), (things, memory) = grown(begin())
        print(f"{offer} {begin.__name__}: things {few_things} → {things}, MB {few / 1e6:.1f} → {memory / 1e6:.1f}")
        assert things <= few_things + HELD and memory <= ROOM * few
    changing.assert_shown()
