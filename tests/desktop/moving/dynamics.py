# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated hair in a window: played, undone, baked, stopped, and deleted during playback.

Run by a desktop Blender as steps.py says, with one of `PARTS`. Writes pictures of the screen.
"""

import itertools
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    MODULE,
    activate,
    addon,
    curve_points,
    in_viewport,
    install,
    key,
    of_kind,
    offscreen_light,
    refine_to,
    take_picture,
    viewport,
    wait,
    wait_for,
    window,
)

LAST = 20  # frame that is played to
COMPARED = 12  # frame whose light is compared, played and baked

SCENE, LIGHT = OUT / "dynamics.blend", OUT / "played.npy"
STRANDS = OUT / "strands.npy"
seen = {}  # frame → strands as they were drawn when it was played


def scene():
    return bpy.context.scene


def strands():
    """Return (S, P, 3) positions of the hair as it is drawn, which may not be written yet."""
    hair = of_kind("HAIR").data
    bound = addon().groom.bindings.of(hair)
    if bound is not None:
        return bound.points.copy()
    return curve_points(of_kind("HAIR")).reshape(len(hair.curves), -1, 3)


def moved(before, after=None):
    """Return the largest distance between strands [m]."""
    after = strands() if after is None else after
    return float(np.linalg.norm(after - before, axis=2).max()) if after.shape == before.shape else math.inf


def light():
    """Return what the 3D view shows of hair."""
    return offscreen_light(addon())


def differ(before, after):
    """Return the part of the pixels with hair whose coverage differs by more than two of their 16 samples."""
    is_hair = (before[..., 3] > 0.0) | (after[..., 3] > 0.0)
    return float((np.abs(before - after)[..., 3] > 2.5 / 16.0)[is_hair].mean())


def state():
    sentence, values = addon().live.dynamics_state.state_of(of_kind("GUIDES").data)
    return sentence.format(**values)


def is_playing():
    return window().screen.is_animation_playing


def play():
    """Press Play from Start; the timeline plays by its own timer."""
    with in_viewport():
        bpy.ops.vellus.play_dynamics("INVOKE_DEFAULT")


def stop():
    if is_playing():
        with in_viewport():
            bpy.ops.screen.animation_cancel(restore_frame=False)


def go_to(frame):
    scene().frame_set(frame)


def look(_scene, _depsgraph):
    """Store the drawn strands; called after the add-on's handler for each change of frame."""
    if of_kind("HAIR") is not None and of_kind("GUIDES") is not None and f"{MODULE}.hair_addon.blender" in sys.modules:
        seen[scene().frame_current] = strands()


# The parts.


def hair_on_a_swinging_ball():
    install(ZIP)
    refine_to()
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    with in_viewport():
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
        ball = bpy.context.object
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=200, length=0.12, strand_count=2000)
    for frame, angle in ((1, 0.0), (8, 0.7), (16, -0.7), (24, 0.0)):
        ball.rotation_euler.y = angle
        ball.keyframe_insert("rotation_euler", frame=frame)
    scene().frame_start, scene().frame_end = 1, 60
    go_to(1)
    view = viewport()[0].spaces.active.region_3d
    view.view_location, view.view_distance = (0.0, 0.0, -0.03), 0.75
    view.view_rotation = Vector((0.3, -1.0, 0.2)).to_track_quat("Z", "Y")
    activate(of_kind("GUIDES"))
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE))
    yield from wait(0.5)


def played():
    """Play the timeline, in whose pictures hair moves."""
    combed, before = strands(), light()
    bpy.app.handlers.frame_change_post.append(look)
    play()
    yield from wait_for(lambda: scene().frame_current >= LAST)
    stop()
    bpy.app.handlers.frame_change_post.remove(look)
    last = scene().frame_current
    numbers = [number for number in range(1, last + 1) if number in seen]
    facts["played"] = {
        "frames": numbers,
        "last": last,
        "start": moved(combed, seen.get(1)),
        "steps": [moved(seen[a], seen[b]) for a, b in itertools.pairwise(numbers)],
        "picture": differ(before, light()),
        "state": state(),
    }
    take_picture(OUT / "played.png", redraws=2)


def jumped_back():
    """Jump to a frame, which is shown as it was played."""
    go_to(COMPARED)
    yield from wait(0.3)
    np.save(LIGHT, light())
    np.save(STRANDS, strands())
    facts["jump"] = {"moved": moved(seen[COMPARED]), "state": state()}


def undone():
    """Undo by Ctrl Z while simulated frames are shown: the operation is undone, and hair stays in place."""
    guides = of_kind("GUIDES")
    shown, before = strands(), guides.data.vellus.dynamics.damping
    with in_viewport():
        bpy.ops.ed.undo_push(message="Before")
        guides.data.vellus.dynamics.damping = 0.123
        bpy.ops.ed.undo_push(message="Damping")
    yield from key("Z", ctrl=True)
    yield from wait(1.5)
    damping = of_kind("GUIDES").data.vellus.dynamics.damping
    facts["undo"] = {"is_undone": damping == before, "frame": scene().frame_current, "moved": moved(shown)}
    facts["undo"]["picture"] = differ(np.load(LIGHT), light())
    go_to(LAST + 4)
    go_to(COMPARED)
    facts["undo"]["moved after a jump"] = moved(shown)
    go_to(1)
    facts["undo"]["at the start"] = moved(seen[1])
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE))


def baked():
    """Bake with its progress, then bake longer and press Esc."""
    scene().frame_end, scene().frame_current = COMPARED + 2, 3
    reported, running = set(), addon().host.running
    with in_viewport():
        bpy.ops.vellus.bake_dynamics("INVOKE_DEFAULT")
    facts["bake"] = {"runs": running.job() is not None}
    while running.job() is not None:
        reported.add(running.job().step)
        yield
    yield from wait(0.5)
    facts["bake"] |= {"steps": sorted(reported), "frames": frames(), "frame": scene().frame_current, "state": state()}
    there = strands()
    go_to(COMPARED)
    yield from wait(0.5)
    facts["bake"]["moved"] = moved(np.load(STRANDS))
    go_to(3)
    facts["bake"]["present frame"] = moved(there)
    go_to(COMPARED)
    facts["bake"]["picture"] = differ(np.load(LIGHT), light())
    facts["bake"]["covered"] = float((np.load(LIGHT)[..., 3] > 0.0).mean())
    take_picture(OUT / "baked.png", redraws=2)


def stopped():
    scene().frame_end = 1000
    before = len(frames())
    with in_viewport():
        bpy.ops.vellus.bake_dynamics("INVOKE_DEFAULT")
    yield from wait_for(lambda: len(frames()) > before + 4)
    yield from key("ESC")
    yield from wait_for(lambda: addon().host.running.job() is None)
    yield from wait(0.5)
    facts["stop"] = {"frames": frames(), "before": before, "frame": scene().frame_current, "state": state()}
    facts["stop"]["moved"] = moved(np.load(STRANDS))
    facts["stop"]["picture"] = differ(np.load(LIGHT), light())
    with in_viewport():
        bpy.ops.vellus.free_dynamics("EXEC_DEFAULT")
    facts["stop"]["freed"] = frames()
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE))


def frames():
    folder = addon().groom.dynamics.frame_folders.folder_of(of_kind("GUIDES").data)
    return sorted(int(path.stem) for path in folder.glob("[+-]*.npz"))


def deleted():
    """Delete guides while they play, and restore them by Ctrl Z."""
    scene().frame_end = 60
    play()
    yield from wait_for(lambda: scene().frame_current >= 6)
    activate(of_kind("GUIDES"))
    with in_viewport():
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.object.delete("EXEC_DEFAULT", True)
    at = scene().frame_current
    yield from wait_for(lambda: scene().frame_current >= at + 4)
    facts["delete"] = {
        "goes on": is_playing() and scene().frame_current >= at + 4,
        "are gone": of_kind("GUIDES") is None,
    }
    stop()
    yield from key("Z", ctrl=True)
    yield from wait(1.0)
    facts["delete"]["are back"] = of_kind("GUIDES") is not None


def disabled():
    """Disable the add-on while the animation plays."""
    activate(of_kind("GUIDES"))
    play()
    yield from wait_for(lambda: scene().frame_current >= 6)
    facts["disable"] = {"state": state(), "are finite": bool(np.isfinite(strands()).all())}
    bpy.ops.preferences.addon_disable(module=MODULE)
    at = scene().frame_current
    yield from wait_for(lambda: scene().frame_current >= at + 4)
    facts["disable"]["goes on"] = is_playing() and scene().frame_current >= at + 4
    stop()
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield from wait(0.5)
    go_to(1)
    go_to(2)
    yield from wait(0.5)


def begin_to_bake(override):
    """Bake in a window's context until some frames are there."""
    scene().frame_current, scene().frame_end = 1, 1000
    with override:
        bpy.ops.vellus.bake_dynamics("INVOKE_DEFAULT")
    yield from more_frames()


def more_frames():
    before = len(frames())
    yield from wait_for(lambda: len(frames()) > before + 3)


def is_busy():
    return addon().host.running.job() is not None or addon().groom.dynamics.guide_baking.is_baking()


def ended():
    """Undo, redo, close the window and disable the add-on while frames are baked."""
    with in_viewport():
        bpy.ops.ed.undo_push(message="Before")
    bpy.ops.wm.window_new()
    yield from wait(1.0)
    second = bpy.context.window_manager.windows[-1]
    yield from begin_to_bake(bpy.context.temp_override(window=second, area=second.screen.areas[0]))
    with in_viewport():
        bpy.ops.ed.undo()
        bpy.ops.ed.redo()
    yield from more_frames()
    facts["ended"] = {"redo": is_busy()}
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1]):
        bpy.ops.wm.window_close()
    yield from wait(1.0)
    facts["ended"]["window closed"] = [is_busy(), scene().frame_current]
    yield from begin_to_bake(in_viewport())
    bpy.ops.preferences.addon_disable(module=MODULE)
    facts["ended"]["add-on disabled"] = scene().frame_current
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield from wait(1.0)
    facts["ended"]["add-on enabled"] = [is_busy(), scene().frame_current]
    with in_viewport():
        bpy.ops.vellus.free_dynamics("EXEC_DEFAULT")


def loaded():
    """Open another file during playback and during a bake."""
    activate(of_kind("GUIDES"))
    scene().frame_end = 1000
    play()
    yield from wait_for(lambda: scene().frame_current >= 6)
    yield from go_on()
    facts["load"] = {"while it plays": state_after_load()}
    yield from begin_to_bake(in_viewport())
    yield from go_on()
    facts["load"]["while it is baked"] = state_after_load()
    play()
    yield from wait_for(lambda: scene().frame_current >= 6)
    stop()
    facts["load"]["plays"] = scene().frame_current >= 6 and bool(np.isfinite(strands()).all())


def state_after_load():
    """Return what is wrong after a file was opened: nothing is computed, and hair has the file's positions."""
    return [] if not is_busy() and np.isfinite(strands()).all() else [state(), is_busy()]


def go_on():
    """Open the file of the previous part."""
    refine_to()
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    yield from wait(1.0)
    activate(of_kind("GUIDES"))


PARTS = {"play": (hair_on_a_swinging_ball, played, jumped_back, undone), "bake": (baked, stopped)}
PARTS |= {"end": (loaded, ended, go_on, deleted, disabled), "vanish": (deleted, disabled)}


if __name__ == "__main__":
    take(PARTS[PART] if PART == next(iter(PARTS)) else (go_on, *PARTS[PART]))
