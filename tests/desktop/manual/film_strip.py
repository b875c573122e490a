# SPDX-License-Identifier: GPL-3.0-or-later
"""From the default cube to hair in the light of paths, and around it, in a window: a picture of each step.

Run by a desktop Blender as steps.py says. Writes `strip_*.png`, and facts: how much of dual scattering the light of
paths replaces at each step.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Quaternion

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    in_viewport,
    install,
    rectangle,
    take_picture,
    viewport,
    wait,
    wait_for,
)

STRAND_COUNT = 3_000
TURN = math.radians(15.0)  # of the view in each step of the orbit


def live():
    """Return the `LiveLight` of the viewport, or None."""
    return next(iter(addon().render.viewport.live_light.light_cache.values()), None)


def note(name):
    """Take a picture of the window, and note the share of light by paths."""
    take_picture(OUT / f"strip_{name}.png", 1)
    shown = live()
    facts.setdefault("parts", {})[name] = 0.0 if shown is None else shown._part()


def hair_rendered():
    """Show the cube's default hair in Rendered shading."""
    install(ZIP)
    bpy.context.preferences.system.viewport_aa = "OFF"
    area, region = viewport()
    facts["view"] = rectangle(region)
    space = area.spaces.active
    space.overlay.show_overlays = space.show_gizmo = False
    note("cube")
    bpy.context.scene.render.engine = "VELLUS"
    space.shading.type = "RENDERED"
    yield from wait(0.5)
    with in_viewport():
        bpy.ops.vellus.add_hair()
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    hair.data.vellus.hair.strand_count = STRAND_COUNT
    yield
    note("hair")


def rest():
    """Wait at rest until all paths are traced."""
    yield from wait_for(lambda: live() is not None and live()._part() > 0.0, 120.0)
    note("first_paths")
    yield from wait_for(lambda: live().is_done, 240.0)
    note("at_rest")


def orbit():
    """Orbit around the hair, which stays in that light."""
    area, _region = viewport()
    view = area.spaces.active.region_3d
    for step in range(3):
        view.view_rotation = Quaternion((0.0, 0.0, 1.0), TURN) @ view.view_rotation
        yield
        note(f"orbit_{step}")


if __name__ == "__main__":
    take([hair_rendered, rest, orbit])
