# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a surface that bends while the timeline plays, and by a slider, in a window.

Run by a desktop Blender as steps.py says. Writes pictures of the screen.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    in_viewport,
    install,
    offscreen_light,
    refine_to,
    take_picture,
    viewport,
    wait,
    wait_for,
)

LAST = 6  # frame that is played to


def ball():
    return bpy.data.objects["Ball"]


def slider():
    return ball().data.shape_keys.key_blocks["Bent"]


def hair():
    return next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")


def evaluated():
    """Return Curves as Blender's evaluation has them for viewports."""
    return hair().evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def positions(curves):
    found = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", found.ravel())
    return found


def state():
    """Return (whether Blender's evaluation leaves out the strands, the largest movement of their points)."""
    shown, stored = evaluated(), hair().data
    is_whole = len(shown.curves) == len(stored.curves)
    moved = float(np.abs(positions(shown) - positions(stored)).max()) if is_whole else 0.0
    return not is_whole, moved


def hair_on_a_ball_that_bends():
    install(ZIP)
    refine_to()
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    with in_viewport():
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
        bpy.context.object.name = "Ball"
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=100, length=0.06, strand_count=1000)
    ball().shape_key_add(name="Basis")
    bent = ball().shape_key_add(name="Bent")
    for point in bent.data:
        point.co.x += 8.0 * max(point.co.z, 0.0) ** 2
    for frame, amount in ((1, 0.0), (LAST, 1.0), (60, 0.0)):
        slider().value = amount
        slider().keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 60
    bpy.context.scene.frame_set(1)
    view = viewport()[0].spaces.active.region_3d
    view.view_location, view.view_distance = (0.02, 0.0, 0.02), 0.7
    with in_viewport():
        bpy.ops.object.select_all(action="DESELECT")
    yield from wait(0.5)


def played():
    """Play the timeline: Blender leaves out the strands, and the window shows them deformed."""
    with in_viewport():
        bpy.ops.screen.animation_play()
    yield from wait_for(lambda: bpy.context.scene.frame_current >= LAST)
    facts["playing"] = state()
    take_picture(OUT / "playing.png", redraws=1)
    facts["playing_light"] = offscreen_light(addon())
    facts["frame"] = bpy.context.scene.frame_current
    with in_viewport():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    yield from wait(0.5)
    facts["stopped"] = state()
    facts["stopped_frame"] = bpy.context.scene.frame_current
    take_picture(OUT / "stopped.png", redraws=1)
    playing, stopped = facts.pop("playing_light"), offscreen_light(addon())
    is_hair = (playing[..., 3] > 0.0) | (stopped[..., 3] > 0.0)
    facts["covered"] = float(is_hair.mean())
    facts["differ"] = float((np.abs(playing - stopped)[..., 3] > 2.5 / 16.0)[is_hair].mean())


def played_beside_workbench():
    """Play with Workbench, which stands for all other engines: its hair is deformed in each frame."""
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    space = viewport()[0].spaces.active
    space.shading.type = "RENDERED"
    with in_viewport():
        bpy.ops.screen.animation_play()
    at = bpy.context.scene.frame_current
    yield from wait_for(lambda: bpy.context.scene.frame_current >= at + 2)
    facts["beside Workbench"] = state()
    with in_viewport():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    space.shading.type = "SOLID"
    yield from wait(0.5)


def dragged():
    """Bend the surface by a slider step by step, and let it rest."""
    ball().data.shape_keys.animation_data_clear()
    yield from wait(0.5)
    for step in range(8):
        slider().value = 0.1 * step
        yield
    facts["dragged"] = state()
    yield from wait_for(lambda: not state()[0])
    facts["rested"] = state()
    take_picture(OUT / "rested.png", redraws=1)


def previewed():
    """Show hair in Material Preview, where it is drawn once and found by View Selected."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"  # Workbench has no Material Preview
    space = viewport()[0].spaces.active
    space.shading.type = "MATERIAL"
    yield from wait_for(lambda: state()[0])
    facts["previewed"] = state()
    yield from wait(1.0)
    take_picture(OUT / "previewed.png", redraws=1)
    with in_viewport():
        hair().select_set(True)
        bpy.ops.view3d.view_selected(use_all_regions=False)
    yield from wait(1.0)
    facts["view"] = list(space.region_3d.view_location)
    space.shading.type = "SOLID"
    yield from wait_for(lambda: not state()[0])
    facts["in Solid again"] = state()


if __name__ == "__main__":
    take((hair_on_a_ball_that_bends, played, played_beside_workbench, dragged, previewed))
