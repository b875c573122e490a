# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's page Curly Hair in ten steps, in a window: from a bare head to curly hair with a fringe.

Run by a desktop Blender as steps.py says, with one of `PARTS`; MORE is how many samples a pixel and strands the hair
has. Writes a picture of the screen for each step, of which `tools/manual_pictures.py curly_hair` makes those of the
page, with as many as an artist sees. After the ten steps a style is keyed, moved and undone, and hair is combed with
its styles on.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.manual import face  # noqa: E402
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    MODULE,
    activate,
    addon,
    click,
    curve_points,
    drag,
    import_head,
    in_viewport,
    install,
    key,
    mask_scalp,
    of_kind,
    places,
    refine_to,
    sidebar,
    take_picture,
    viewport,
    wait,
    wait_for,
)

# The defaults are low for drivers without a GPU, which take one sample per redraw.
SAMPLES, STRAND_COUNT = map(int, MORE) if MORE else (2, 3_000)

# Pixels from the upper left corner of a sidebar of the default width that shows the panel Styles alone.
_ADD_FIRST = (120, 46)  # the button of a hair without styles
_ADD = (241, 46)  # beside the list

SCENE = OUT / "curly_hair.blend"
hidden = []  # panels that the sidebar does not show


def picture(name):
    take_picture(OUT / f"{name}.png", SAMPLES)


def hair_object():
    return of_kind("HAIR")


def guides_object():
    return of_kind("GUIDES")


def strands():
    """Return (S, P, 3) positions of the hair as it is drawn, which may not be written yet."""
    bound = addon().groom.bindings.of(hair_object().data)
    if bound is not None:
        return bound.points.copy()
    return curve_points(hair_object()).reshape(len(hair_object().data.curves), -1, 3)


def moved(before):
    """Return the largest distance by which strands moved [m]."""
    after = strands()
    return float(np.linalg.norm(after - before, axis=2).max()) if after.shape == before.shape else math.inf


def show_styles_alone():
    """Show only the panel Styles in the sidebar's tab."""
    classes = addon().panels.CLASSES
    for panel in reversed(classes):
        is_shown = panel.bl_idname.startswith(("VELLUS_PT_style", "VELLUS_UL"))
        if not is_shown and panel.is_registered and getattr(panel, "bl_category", "") == "Hair":
            bpy.utils.unregister_class(panel)
            hidden.append(panel)


def show_all_panels():
    """Restore the panels that `show_styles_alone` removed, as the add-on unregisters all of its panels at the end."""
    while hidden:
        bpy.utils.register_class(hidden.pop())


def add_style(offer):
    """Press the button of the panel, and choose the entry of its menu by the keyboard."""
    state = hair_object().data.vellus
    panel = sidebar()
    x, y = _ADD if len(state.styles) else _ADD_FIRST
    place = panel.x + x, panel.y + panel.height - y
    yield from click(*place)
    yield from wait(0.2)
    count = len(state.styles)
    for _entry in range(1 + list(offers()).index(offer)):
        yield from key("DOWN_ARROW", place)
    yield from key("RET", place)
    yield from wait_for(lambda: len(state.styles) > count)
    yield from wait(1.0)


def offers():
    return sys.modules[f"{MODULE}.hair_addon.core"].styling.kinds.OFFERS


# The ten steps.


def bare_head():
    """1. A head with a vertex group where hair grows."""
    install(ZIP)
    if not MORE:
        refine_to(SAMPLES)
    bpy.context.preferences.system.use_region_overlap = False
    for thing in list(bpy.data.objects):
        if thing.type == "MESH":
            bpy.data.objects.remove(thing)
    head = import_head()
    with in_viewport():
        bpy.ops.object.shade_smooth()
    above, positions = mask_scalp(head)
    if MORE:
        face.dress(head, (0.55, -1.0, 0.85))
        face.light()
    fringe = head.vertex_groups.new(name="fringe")
    is_front = above & (positions[:, 1] < -0.085) & (np.abs(positions[:, 0]) < 0.075)
    fringe.add(np.flatnonzero(is_front).tolist(), 1.0, "REPLACE")
    area, _region = viewport()
    area.spaces.active.show_region_ui = True
    area.spaces.active.overlay.show_extras = False  # lamps and the camera
    view = area.spaces.active.region_3d
    view.view_location, view.view_distance = (0.02, -0.03, 0.70), 0.6
    view.view_rotation = Vector((0.55, -1.0, 0.18)).to_track_quat("Z", "Y")
    yield from wait(0.5)
    sidebar().active_panel_category = "Hair"
    yield from wait(0.5)
    picture("bare_head")


def hair_system():
    """2. New Hair System, with Guide Mask scalp, 0.24 m long, Gravity 0.9, draped."""
    with in_viewport():
        bpy.ops.vellus.add_hair("INVOKE_DEFAULT")
    yield from wait_for(lambda: hair_object() is not None)
    guides, hair = guides_object().data.vellus.guides, hair_object().data.vellus.hair
    guides.density_group, guides.length, guides.gravity, guides.drape = "scalp", 0.24, 0.9, True
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
    middle = places(curve_points(guides_object())[20::41]).mean(axis=0)
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
    facts["are finite"] = bool(np.isfinite(strands()).all())
    picture("look")


# Beyond the page.


def key_move_undo():
    """Key and move a style, and undo the move: the key stays with the style."""
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
    """Return the name of the style that the action's curve drives."""
    animation = hair_object().data.animation_data
    bag = animation.action.layers[0].strips[0].channelbags[0]
    path = bag.fcurves[0].data_path
    return hair_object().data.path_resolve(path.rpartition(".")[0].rpartition(".")[0]).name


def comb_styled():
    """Comb hair with its styles on."""
    activate(guides_object())
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(0.5)
    bpy.context.tool_settings.curves_sculpt.unified_paint_settings.size = 130
    before = strands()
    middle = places(curve_points(guides_object())[20::41]).mean(axis=0)
    followed = []
    stroke = drag(middle + np.array([-60, 60]), middle + np.array([160, 40]), steps=16)
    for number, _pause in enumerate(stroke):
        yield
        if number == 12:
            followed.append(moved(before))
    yield from wait(1.5)
    facts["combed with styles"] = {"while the brush moves": followed[0] if followed else 0.0, "after": moved(before)}
    facts["stay finite"] = bool(np.isfinite(strands()).all())
    picture("combed_styled")


def go_on():
    """Open the file of the previous part."""
    if not MORE:
        refine_to(SAMPLES)
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    yield from wait(1.0)
    activate(hair_object())
    show_styles_alone()
    yield from wait(1.0)


def save():
    """Save the file for the next part."""
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE))
    yield


PARTS = {
    "cut": (bare_head, hair_system, comb, shoulder_length, fringe),
    "curl": (locks, curls, smooth_curls, paint, look),
}
PARTS["curl_and_beyond"] = (*PARTS["curl"], save, go_on, key_move_undo, comb_styled)


if __name__ == "__main__":
    begun = () if PART == next(iter(PARTS)) else (go_on,)
    take((*begun, *PARTS[PART], save), at_the_end=show_all_panels)
