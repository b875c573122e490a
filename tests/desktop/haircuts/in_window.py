# SPDX-License-Identifier: GPL-3.0-or-later
"""A haircut in a window, by the steps of haircuts.py; run by a desktop Blender as steps.py says.

PART is the name of the haircut, MORE the file of the head, the number of strands that the window shows, and that of the
file PART.blend that is left in OUT.
"""

import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.haircuts import hands  # noqa: E402
from tests.desktop.haircuts.haircuts import HAIRCUTS  # noqa: E402
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import in_viewport, install, refine_to, take_picture, viewport, wait  # noqa: E402

HEAD, SHOWN, KEPT = MORE[0], int(MORE[1]), int(MORE[2])


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
        if hands.hair() is not None and hands.hair().data.vellus.hair.strand_count > SHOWN:
            hands.hair().data.vellus.hair.strand_count = SHOWN  # software drivers draw slowly
            with in_viewport():
                bpy.ops.vellus.toggle_drawing()
            yield from wait(0.3)
    facts[PART] = hands.count.facts()


def save():
    take_picture(OUT / f"{PART}_window.png")
    if hands.hair() is not None:
        facts[PART]["status"] = [hands.hair().data.vellus.status, hands.guides().data.vellus.status]
        hands.hair().data.vellus.hair.strand_count, hands.hair().data.vellus.is_drawn = KEPT, True
        yield from wait(2.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / f"{PART}.blend"))
    yield


if __name__ == "__main__":
    take((open_head, cut, save), pause=0.02)
