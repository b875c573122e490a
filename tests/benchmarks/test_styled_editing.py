# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair with three styles while guides are combed and sliders are moved, beside the same hair without: printed.

Blender runs without a window, but handlers act as if it had one. Times end with the arrays that the picture reads.
Nothing is uploaded or drawn, as Vellus has the same to upload with styles and without.
"""

from itertools import count

import bpy
import pytest

import hair_addon
from hair_addon import api
from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.settings import style_items
from hair_addon.core.styling import clump, curl, frizz, steps
from tests.benchmarks import hair_peers
from tests.benchmarks.test_hair_speed import best_times, report
from tests.support.counting import counts_of

STRAND_COUNT = 100_000
SIZE = 0.01125  # of clumps [m]: 1,500 sites on the head
THREE = (clump.Settings(levels=1, size=SIZE), curl.Settings(), frizz.Settings())


@pytest.fixture
def hair(monkeypatch):
    """Return hair of 100,000 strands between 4,000 guides, as in a window."""
    hair_addon.register()
    _surface, guides = hair_peers.head_with_guides()
    way = hair_peers.Ours.grown(guides, STRAND_COUNT)
    monkeypatch.setattr(running, "has_window", lambda: True)
    yield way
    live_hair.cancel_writing()
    invalidation.data_replaced()
    hair_addon.unregister()


def slide(hair, place, name, values):
    """Set another value of a style's setting, and let Blender update."""
    setattr(style_items.group_of(hair.vellus.styles[place]), name, next(values))
    bpy.context.view_layer.update()


def made(hair, change):
    """Make a change and wait for the strands, which other threads compute."""
    change()
    return bindings.of(hair).points


def near(value):
    """Return distinct values close to one."""
    return (value * (1.0 + 0.001 * step) for step in count(1))


@pytest.mark.long
def test_styled_editing(hair, monkeypatch):
    data = hair.hair.data
    calls = {
        "all guides": lambda: made(data, lambda: hair_peers.move(hair.guides, slice(None))),
        "one of 4,000 guides": lambda: made(data, lambda: hair_peers.move(hair.guides, slice(0, 1))),
    }
    plain = best_times(calls, 7)
    api.set_styles(data, THREE)
    bpy.context.view_layer.update()
    best_times(calls, 1)  # what compiles
    counts = counts_of(monkeypatch)
    launched = []
    apply_steps = steps.apply_steps
    monkeypatch.setattr(steps, "apply_steps", lambda *args: launched.append(1) or apply_steps(*args))
    radius, amount, size = near(0.005), near(0.5), near(SIZE)
    styled = best_times(
        calls
        | {
            "slider: Curl, Radius": lambda: made(data, lambda: slide(data, 1, "radius", radius)),
            "slider: Frizz, Amount": lambda: made(data, lambda: slide(data, 2, "amount", amount)),
        },
        7,
    )
    assert counts["searches"] == counts["writes"] == 0
    assert len(launched) >= 4 * 7  # each of the changes styled strands
    styled |= best_times({"slider: Clump, Size": lambda: made(data, lambda: slide(data, 0, "size", size))}, 3)
    asked = {"all guides": "80 ms", "one of 4,000 guides": "4 ms", "slider: Clump, Size": "350 ms"}
    asked |= {name: "80 ms" for name in styled if name not in asked}
    times = {f"{name}, no styles": found for name, found in plain.items()} | styled
    report("Editing hair with Clump, Curl, Frizz", STRAND_COUNT, times, asked, "all guides, no styles")
    share = style_bytes(data) / bindings.of(data).points.nbytes
    print(f"  memory of styles: {100.0 * share:.1f} % of the points' (6 asked)")
    assert share < 0.06


def style_bytes(hair):
    """Return the memory of the styles of bound hair, except the normals and identities that strands have anyway."""
    styling = bindings.of(hair).styles.styling
    kept = [styling.data.masks, styling.data.members, styling.data.centre_points, styling.data.centre_normals]
    kept += [array for level in styling.levels for array in (level.data.masks, level.data.members)]
    return sum(array.capacity for array in kept)
