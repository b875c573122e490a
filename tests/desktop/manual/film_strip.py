# SPDX-License-Identifier: GPL-3.0-or-later
"""From the default cube to a render, in a window: hair, combing, an orbit, the light of paths at rest and F12.

Run by a desktop Blender as steps.py says; MORE is how many samples a pixel and strands the hair has. Writes
`strip_*.png`, of which `tools/manual_pictures.py film_strip` makes the manual's picture, and facts: how much of dual
scattering the light of paths replaces at each step.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import MORE, OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    curve_points,
    drag,
    in_viewport,
    install,
    of_kind,
    places,
    refine_to,
    take_picture,
    viewport,
    wait,
    wait_for,
)

SAMPLES, STRAND_COUNT = map(int, MORE) if MORE else (2, 3_000)
TURN = math.radians(15.0)  # of the view in each step of the orbit


def live():
    """Return the `LiveLight` of the viewport, or None."""
    return next(iter(addon().render.viewport.live_light.light_cache.values()), None)


def note(name, redraws=SAMPLES):
    """Take a picture of the window, and note the share of light by paths."""
    take_picture(OUT / f"strip_{name}.png", redraws)
    shown = live()
    facts.setdefault("parts", {})[name] = 0.0 if shown is None else shown._part()


def hair():
    """Add hair to the default cube in Solid shading."""
    install(ZIP)
    bpy.context.preferences.system.viewport_aa = "OFF"
    if not MORE:
        refine_to(SAMPLES)
    space = viewport()[0].spaces.active
    space.overlay.show_extras = space.overlay.show_cursor = space.show_gizmo = space.show_region_toolbar = False
    space.region_3d.view_distance = 7.0
    yield
    note("cube")
    with in_viewport():
        bpy.ops.vellus.add_hair("INVOKE_DEFAULT")
    yield from wait_for(lambda: of_kind("HAIR") is not None)
    of_kind("HAIR").data.vellus.hair.strand_count = STRAND_COUNT
    yield
    note("first_picture", 1)
    note("hair")


def comb():
    """Comb the guides downward over the front of the cube."""
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(1.0)
    bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 250
    roots = places(curve_points(of_kind("GUIDES"))[::41])
    middle, width = roots.mean(axis=0), 0.5 * np.ptp(roots[:, 0])
    for aside in (-0.6, -0.2, 0.2, 0.6):
        start = middle + np.array([aside * width, 0.5 * width])
        yield from drag(start, start - np.array([0.0, width]))
    yield from wait(1.0)
    note("combed")
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.vellus.select_hair()
    yield


def orbit():
    """Orbit around the hair, with one picture in motion and one at rest."""
    view = viewport()[0].spaces.active.region_3d
    for step in range(3):
        view.view_rotation = Quaternion((0.0, 0.0, 1.0), TURN) @ view.view_rotation
        yield
        note(f"orbit_{step}", 1)
    note("orbit")


def render():
    """Show Rendered shading at rest until all paths are traced, then render the same view."""
    area, region = viewport()
    scene, space = bpy.context.scene, area.spaces.active
    scene.render.engine, space.shading.type = "VELLUS", "RENDERED"
    yield from wait(0.5)
    note("rendered")
    yield from wait_for(lambda: live() is not None and live().is_done, 240.0)
    note("at_rest")
    view = space.region_3d
    scene.camera.matrix_world = view.view_matrix.inverted()
    scene.camera.data.lens = 0.5 * space.lens  # a viewport's sensor is twice as wide as a camera's
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    scene.render.resolution_percentage = 100
    scene.render.filepath = str(OUT / "strip_f12.png")
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    take([hair, comb, orbit, render])
