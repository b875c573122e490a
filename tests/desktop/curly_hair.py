# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's page Curly Hair in ten steps, in a window: from a bare head to curly hair with a fringe.

Run by a desktop Blender: curly_hair.py -- PART ZIP HEAD OUT. Writes a picture of the screen for each step to OUT, and
curly_hair.json with what the tests want to know. The page's pictures are made of them by
`tools/manual_pictures.py curly_hair`. After the ten steps a style is keyed, moved and undone, and hair is combed with
its styles on. Each of the `PARTS` runs in a Blender of its own and goes on with the file of the one before: a hundred
redraws in a row crash Blender 5.2.2 on Mesa's software Vulkan, with or without add-on.
"""

import json
import math
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop import window as desktop  # noqa: E402
from tests.desktop.window import drag, import_head, in_viewport, places, take_picture, viewport, wait, wait_for  # noqa: E402

PART, ZIP, HEAD, OUT = sys.argv[sys.argv.index("--") + 1 :]
OUT = Path(OUT)

STRAND_COUNT = 16_000  # software drivers take their time for each

# Pixels from the upper left corner of a sidebar of the default width that shows the panel Styles alone.
_ADD_FIRST = (120, 46)  # the button of a hair without styles
_ADD = (241, 46)  # beside the list

# The hairline of the sample's head from the side, (y, z) [m], from the forehead to the nape; the face looks to -Y.
_HAIRLINE = np.array([(-0.17, 0.82), (-0.105, 0.787), (-0.068, 0.74), (-0.03, 0.744), (0.0, 0.69), (0.04, 0.68)])

FACTS, SCENE = OUT / "curly_hair.json", OUT / "curly_hair.blend"
facts = json.loads(FACTS.read_text()) if FACTS.exists() else {"steps": [], "done": []}
hidden = []  # panels that the sidebar does not show


def picture(name):
    take_picture(OUT / f"{name}.png")
    facts["steps"].append(name)
    print(f"curly_hair: {name}", flush=True)


def hair_object():
    return next((o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"), None)


def guides_object():
    return next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "GUIDES")


def points(curves_object):
    """(N, 3) positions, which have the world's coordinates."""
    curves = curves_object.data
    values = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", values.ravel())
    return values


def strands():
    """(S, P, 3) positions of the hair as it is drawn, which may not be written yet."""
    bound = sys.modules[f"{desktop.MODULE}.hair_addon.blender"].groom.bindings.of(hair_object().data)
    if bound is not None:
        return bound.points.copy()
    return points(hair_object()).reshape(len(hair_object().data.curves), -1, 3)


def moved(before):
    """The largest distance by which strands moved [m]."""
    after = strands()
    return float(np.linalg.norm(after - before, axis=2).max()) if after.shape == before.shape else math.inf


def sidebar():
    area, _region = viewport()
    return next(region for region in area.regions if region.type == "UI")


def activate(chosen):
    with in_viewport():
        bpy.ops.object.select_all(action="DESELECT")
    chosen.select_set(True)
    bpy.context.view_layer.objects.active = chosen


def key(name):
    """A key, pressed and let go where the mouse is."""
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type=name, value="PRESS", x=_mouse[0], y=_mouse[1])
    yield
    window.event_simulate(type=name, value="RELEASE", x=_mouse[0], y=_mouse[1])
    yield from wait(0.2)


_mouse = [0, 0]


def click(x, y):
    """The left mouse button, pressed and let go at a place of the window."""
    _mouse[:] = int(x), int(y)
    yield from drag(np.array([x, y]), np.array([x, y]), steps=1)
    yield from wait(0.5)


def show_styles_alone():
    """Of the tab's panels, the sidebar shows Styles and no other."""
    classes = sys.modules[f"{desktop.MODULE}.hair_addon.blender"].panels.CLASSES
    for panel in reversed(classes):
        is_shown = panel.bl_idname.startswith(("VELLUS_PT_style", "VELLUS_UL"))
        if not is_shown and panel.is_registered and getattr(panel, "bl_category", "") == "Hair":
            bpy.utils.unregister_class(panel)
            hidden.append(panel)


def show_all_panels():
    """What `show_styles_alone` took away comes back: the add-on unregisters all of its panels at the end."""
    while hidden:
        bpy.utils.register_class(hidden.pop())


def add_style(offer):
    """The button of the panel, and the entry of its menu by the keyboard."""
    state = hair_object().data.vellus
    panel = sidebar()
    x, y = _ADD if len(state.styles) else _ADD_FIRST
    yield from click(panel.x + x, panel.y + panel.height - y)
    count = len(state.styles)
    for _entry in range(1 + list(offers()).index(offer)):
        yield from key("DOWN_ARROW")
    yield from key("RET")
    yield from wait_for(lambda: len(state.styles) > count, 10.0)
    yield from wait(1.0)


def offers():
    return sys.modules[f"{desktop.MODULE}.hair_addon.core"].styling.kinds.OFFERS


# The ten steps.


def bare_head():
    """1. A head with a vertex group where hair grows."""
    desktop.install(ZIP)
    bpy.context.preferences.system.use_region_overlap = False
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    head = import_head(HEAD)
    with in_viewport():
        bpy.ops.object.shade_smooth()
    positions = np.empty((len(head.data.vertices), 3), np.float32)
    head.data.vertices.foreach_get("co", positions.ravel())
    scalp = head.vertex_groups.new(name="scalp")
    above = positions[:, 2] > np.interp(positions[:, 1], *_HAIRLINE.T)
    scalp.add(np.flatnonzero(above).tolist(), 1.0, "REPLACE")
    fringe = head.vertex_groups.new(name="fringe")
    is_front = above & (positions[:, 1] < -0.085) & (np.abs(positions[:, 0]) < 0.075)
    fringe.add(np.flatnonzero(is_front).tolist(), 1.0, "REPLACE")
    area, _region = viewport()
    area.spaces.active.show_region_ui = True
    view = area.spaces.active.region_3d
    view.view_location, view.view_distance = (0.02, -0.03, 0.70), 0.6
    view.view_rotation = Vector((0.55, -1.0, 0.18)).to_track_quat("Z", "Y")
    yield from wait(0.5)
    sidebar().active_panel_category = "Hair"
    yield from wait(0.5)
    picture("bare_head")


def hair_system():
    """2. New Hair System, with Guide Mask scalp, 0.24 m long, Bend 0.9."""
    with in_viewport():
        bpy.ops.vellus.add_hair("INVOKE_DEFAULT")
    yield from wait_for(lambda: hair_object() is not None)
    guides, hair = guides_object().data.vellus.guides, hair_object().data.vellus.hair
    guides.density_group, guides.length, guides.gravity = "scalp", 0.24, 0.9
    hair.strand_count, hair.thickness = STRAND_COUNT, 0.2
    yield from wait_for(lambda: len(hair_object().data.curves) == STRAND_COUNT)
    yield from wait(1.0)
    picture("hair_system")


def comb():
    """3. Comb Guides: strokes from the face to the back, on both sides."""
    activate(guides_object())
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(0.5)
    before = strands()
    bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 130
    middle = places(points(guides_object())[20::41]).mean(axis=0)
    for start, end in (((-60, 60), (160, 40)), ((-60, 0), (170, -20)), ((-90, 60), (-220, 20))):
        yield from drag(middle + np.array(start), middle + np.array(end))
    yield from wait(1.5)
    facts["combed"] = moved(before)
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
    picture("combed")


def shoulder_length():
    """4. Add Style, Trim: Maximum Length 0.2 m, Random Length 0.1."""
    activate(hair_object())
    show_styles_alone()
    yield from wait(1.0)
    yield from add_style("TRIM")
    trim = hair_object().data.vellus.styles["Trim"].trim
    trim.to_length, trim.random = 0.2, 0.1
    yield from wait(1.5)
    picture("shoulder_length")


def fringe():
    """5. Add Style, Trim again: Maximum Length 0.07 m, Mask fringe."""
    yield from add_style("TRIM")
    item = hair_object().data.vellus.styles[1]
    item.name = "Fringe"
    item.trim.to_length, item.trim.mask = 0.07, "fringe"
    yield from wait(1.5)
    picture("fringe")


def locks():
    """6. Add Style, Clump: Size 0.02 m."""
    yield from add_style("CLUMP")
    clump = hair_object().data.vellus.styles["Clump"].clump
    clump.size, clump.fine_amount, clump.shape = 0.02, 1.0, 0.2
    yield from wait(1.5)
    picture("locks")


def curls():
    """7. Add Style, Curl: Radius 0.006 m, Pitch 0.02 m, Coherence 0.97."""
    before = strands()
    yield from add_style("CURL")
    curl = hair_object().data.vellus.styles["Curl"].curl
    curl.radius, curl.pitch, curl.coherence = 0.006, 0.02, 0.97
    yield from wait(1.5)
    facts["curled"] = moved(before)
    picture("curls")


def smooth_curls():
    """8. Use Points for Curls."""
    with in_viewport():
        bpy.ops.vellus.use_points()
    yield from wait(1.5)
    facts["points"] = hair_object().data.vellus.hair.point_count
    picture("smooth_curls")


def paint():
    """9. Paint Style Mask: curls are painted off the crown, and hair follows the brush."""
    state = hair_object().data.vellus
    state.active_style = state.styles.find("Curl")
    head = hair_object().data.surface
    with in_viewport():
        bpy.ops.vellus.paint_style_mask()
    yield from wait(1.0)
    facts["painting"] = [bpy.context.mode, state.styles["Curl"].curl.mask]
    group = head.vertex_groups[state.styles["Curl"].curl.mask]
    group.add(range(len(head.data.vertices)), 1.0, "REPLACE")
    head.data.update()
    yield from wait(1.0)
    unified = bpy.context.tool_settings.weight_paint.unified_paint_settings
    unified.weight, unified.size = 0.0, 70
    bpy.context.tool_settings.weight_paint.brush.weight = 0.0
    before = strands()
    top = places(np.array([[0.02, -0.10, 0.84], [0.02, 0.0, 0.85]]))
    start, end = top[0], top[1]
    followed = []
    stroke = drag(start - np.array([60, 0]), end + np.array([60, 0]), steps=16)
    for number, _pause in enumerate(stroke):
        yield
        if number == 12:  # the button is still held
            followed.append(moved(before))
    yield from wait(1.0)
    facts["painted"] = {"while the brush moves": followed[0] if followed else 0.0, "after": moved(before)}
    picture("painted")
    with in_viewport():
        bpy.ops.vellus.paint_style_mask()
    yield from wait(1.0)
    facts["mode after painting"] = bpy.context.mode


def look():
    """10. Add Style, Frizz: Amplitude 0.0006 m; a look."""
    activate(hair_object())
    yield from wait(0.5)
    yield from add_style("FRIZZ")
    hair_object().data.vellus.styles["Frizz"].frizz.amplitude = 0.0006
    with in_viewport():
        bpy.ops.vellus.apply_preset(preset="AUBURN")
    yield from wait(2.0)
    facts["styles"] = [item.name for item in hair_object().data.vellus.styles]
    facts["status"] = hair_object().data.vellus.status
    picture("look")


# Beyond the page.


def key_move_undo():
    """A style is keyed, moved, and the move undone: the key stays with it."""
    hair = hair_object().data
    state = hair.vellus
    hair.vellus.styles["Curl"].curl.keyframe_insert("amount", frame=1)
    state.active_style = state.styles.find("Curl")
    with in_viewport():
        bpy.ops.ed.undo_push(message="Keyed")
        bpy.ops.vellus.move_style("EXEC_DEFAULT", True, direction="UP")
    yield from wait(1.0)
    facts["moved"] = [item.name for item in hair_object().data.vellus.styles]
    facts["keyed"] = keyed_style()
    with in_viewport():
        bpy.ops.ed.undo()
    yield from wait(1.5)
    facts["undone"] = [item.name for item in hair_object().data.vellus.styles]
    facts["keyed after undo"] = keyed_style()
    picture("undone")


def keyed_style():
    """The name of the style that the curve of the action drives."""
    animation = hair_object().data.animation_data
    bag = animation.action.layers[0].strips[0].channelbags[0]
    path = bag.fcurves[0].data_path
    return hair_object().data.path_resolve(path.rpartition(".")[0].rpartition(".")[0]).name


def comb_styled():
    """Hair is combed with its styles on."""
    activate(guides_object())
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(0.5)
    bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 130
    before = strands()
    middle = places(points(guides_object())[20::41]).mean(axis=0)
    followed = []
    stroke = drag(middle + np.array([-60, 60]), middle + np.array([160, 40]), steps=16)
    for number, _pause in enumerate(stroke):
        yield
        if number == 12:
            followed.append(moved(before))
    yield from wait(1.5)
    facts["combed with styles"] = {"while the brush moves": followed[0] if followed else 0.0, "after": moved(before)}
    facts["are finite"] = bool(np.isfinite(strands()).all())
    picture("combed_styled")


PARTS = {
    "cut": (bare_head, hair_system, comb, shoulder_length, fringe),
    "curl": (locks, curls, smooth_curls, paint, look),
    "beyond": (key_move_undo, comb_styled),
}


def go_on():
    """Open the file of the part before."""
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    yield from wait(1.0)
    activate(hair_object())
    show_styles_alone()
    yield from wait(1.0)


def walk():
    """All steps of a part; between them Blender handles its events and redraws."""
    parts = PARTS[PART] if PART == next(iter(PARTS)) else (go_on, *PARTS[PART])
    for part in parts:
        yield from part()
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE))


def advance(steps):
    """Called by Blender between redraws; ends Blender after the last step, or the first that fails."""
    try:
        next(steps)
        return 0.05
    except StopIteration:
        facts["done"].append(PART)
    except Exception:
        traceback.print_exc()
    show_all_panels()
    FACTS.write_text(json.dumps(facts, indent=1))
    bpy.ops.wm.quit_blender()
    return None


if __name__ == "__main__":
    bpy.context.preferences.view.show_splash = False  # before it is shown: it would take the first click
    walking = walk()
    bpy.app.timers.register(lambda: advance(walking), first_interval=1.0, persistent=True)
