# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers for scripts of walks: arguments, results for the tests, and pauses between steps.

Run by a desktop Blender: SCRIPT -- PART ZIP OUT [MORE …]. Each part of a walk has a Blender of its own and goes on with
what the part before left in OUT: a hundred redraws in a row crash Blender 5.2.2 on Mesa's software Vulkan, with or
without add-on.
"""

import json
import sys
import time
import traceback
from pathlib import Path

import bpy

PART, ZIP, _OUT, *MORE = sys.argv[sys.argv.index("--") + 1 :]
OUT = Path(_OUT)

_FACTS = OUT / "facts.json"
facts = json.loads(_FACTS.read_text()) if _FACTS.exists() else {"done": []}


def take(steps, pause=0.05, at_the_end=None):
    """Take steps once Blender has its window, and end Blender after the last of them, or the first that fails.

    steps: functions that yield where Blender may handle its events and redraw, for `pause` seconds and more.
    at_the_end: function that is called before Blender ends, also after a failure.
    """
    bpy.context.preferences.view.show_splash = False  # before it is shown: it would take the first click
    taking = _take(steps)

    def advance():
        try:
            next(taking)
            return pause
        except StopIteration:
            facts["done"].append(PART)
        except Exception:
            traceback.print_exc()
        if at_the_end is not None:
            at_the_end()
        _FACTS.write_text(json.dumps(facts, indent=1, default=int))
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(advance, first_interval=1.0, persistent=True)


def _take(steps):
    for step in steps:
        start = time.monotonic()
        print(f"{step.__name__} …", flush=True)
        yield from step()
        print(f"{step.__name__}: {time.monotonic() - start:.1f} s", flush=True)
