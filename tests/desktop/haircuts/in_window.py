# SPDX-License-Identifier: GPL-3.0-or-later
"""A haircut in a window, by the steps of haircuts.py; run by a desktop Blender as steps.py says.

PART is the name of the haircut, MORE the file of the head, the number of strands that the window shows, and that of the
files PART.blend and PART_remeshed.blend, with another mesh of the head and twice the guides, that are left in OUT.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.haircuts import hands  # noqa: E402
from tests.desktop.haircuts.comparison import distances  # noqa: E402
from tests.desktop.haircuts.haircuts import HAIRCUTS  # noqa: E402
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    curve_points,
    in_viewport,
    install,
    refine_to,
    take_picture,
    viewport,
    wait,
    wait_for,
)

HEAD, SHOWN, KEPT = MORE[0], int(MORE[1]), int(MORE[2])
FEW = 2500  # strands at most that are shown in full
VOXEL = 0.005  # [m]
COMPARED = 4000  # strands before and after


def open_head():
    install(ZIP)
    refine_to(1)
    with in_viewport():
        bpy.ops.wm.open_mainfile(filepath=HEAD, load_ui=False)
    yield from wait(1.0)
    area, _region = viewport()
    area.spaces.active.overlay.show_extras = False  # lamps and the camera
    hands.begin()


def cut():
    for step in HAIRCUTS[PART]:
        yield from step()
        if hands.hair() is not None and hands.hair().data.vellus.hair.strand_count > FEW:
            hands.hair().data.vellus.hair.strand_count = SHOWN  # software drivers draw slowly
            with in_viewport():
                bpy.ops.vellus.toggle_drawing()
            yield from wait(0.3)
    facts[PART] = hands.count.facts()


def save():
    take_picture(OUT / f"{PART}_window.png")
    strands = yield from _strands()
    facts[PART]["before the eyes"] = float(_is_before_eyes(strands).mean())
    yield from _save(PART)


def _save(name):
    facts[PART]["status"] = [hands.hair().data.vellus.status, hands.guides().data.vellus.status]
    systems = [data.vellus for data in bpy.data.hair_curves if data.vellus.kind == "HAIR"]
    for system in systems:
        system.is_drawn = True
    yield from _count_changed(KEPT)
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / f"{name}.blend"))
    for system in systems:
        system.is_drawn = False
    yield from _count_changed(SHOWN)


def _count_changed(count):
    """Change the number of strands, and yield until this and all earlier changes are complete."""
    hands.hair().data.vellus.hair.strand_count = count
    yield from wait_for(lambda: len(hands.hair().data.curves) == count)
    yield from wait(0.3)


def _strands():
    """Return (COMPARED, P, 3) points, without styles, because the places of locks depend on the strands."""
    hair = hands.hair().data
    for item in hair.vellus.styles:
        getattr(item, item.kind.lower()).is_on = False
    yield from _count_changed(COMPARED)
    found = curve_points(hands.hair()).reshape(COMPARED, -1, 3).astype(np.float64)
    for item in hair.vellus.styles:
        getattr(item, item.kind.lower()).is_on = True
    yield from _count_changed(SHOWN)
    return found


def _is_before_eyes(strands):
    """Return (S,) whether strands hang in front of the eyes of the sample head, or of its face below them."""
    x, y, z = np.moveaxis(strands, 2, 0)
    return ((abs(x) < 0.05) & (y < -0.11) & (z < 0.736) & (z > 0.62)).any(axis=1)


def remesh():
    """Remesh the head and double the guides; measure distances from former strands, and between neighbors before."""
    before = yield from _strands()
    yield from hands.select("Hair Guides")()
    if not len(hands.guides().data.vellus.layers):
        yield from hands.press("vellus.add_layer")()
    yield from hands.remeshed(VOXEL)()
    yield from hands.select("Hair Guides")()
    count = 2 * len(hands.guides().data.curves)
    yield from hands.fields("guides", guide_count=count)()
    yield from wait_for(lambda: len(hands.guides().data.curves) == count)
    yield from wait(1.0)
    after = yield from _strands()
    apart, neighbors = distances(after, before), distances(before, before, nearest=2)
    facts[PART]["remeshed"] = {
        "guides": len(hands.guides().data.curves),
        "within 5 %": float((apart < 0.05).mean()),
        "median": float(np.median(apart)),
        "neighbors within 5 %": float((neighbors < 0.05).mean()),
    }
    yield from _save(f"{PART}_remeshed")


if __name__ == "__main__":
    take((open_head, cut, save, remesh), pause=0.02)
