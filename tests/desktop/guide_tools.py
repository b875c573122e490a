# SPDX-License-Identifier: GPL-3.0-or-later
"""Each guide tool in Sculpt Mode in a window: run from its menu, redone with another value, undone, redone and undone.

Run by a desktop Blender as steps.py says. Writes a picture of the menu. Afterwards the hair is combed without its
styles, made tubes, saved as an asset and applied.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop import grooms  # noqa: E402
from tests.desktop.steps import OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    curve_points,
    drag,
    in_viewport,
    install,
    key,
    of_kind,
    places,
    refine_to,
    remove_objects,
    take_picture,
    viewport,
    wait,
    wait_for,
    window,
)

# Tool → settings that the redo panel changes.
TOOLS = {
    "guide_length": {"factor": 0.5},
    "trim_guides": {"cutter": "Lower"},
    "smooth_guides": {"iterations": 200},
    "lift_guides": {"amount": 0.9},
    "attract_guides": {"amount": 0.9},
    "drape_guides": {"stiffness": 0.05},
    "change_guide_count": {"factor": 3.0},
    "mirror_guides": {"selected_only": False},
    "copy_guide_shape": {"amount": 0.5},
}

# In the order of the menu. Gather asks for a curve, and no guide is inside the sphere for Push Outside.
MENU = (*list(TOOLS)[:6], "push_outside", "draw_tie", "gather_guides", *list(TOOLS)[6:])

for step in ("tools", "tubes", "shelf", "brush", "tie"):
    facts.setdefault(step, {})


def guides():
    """Return (G, 41, 3) positions."""
    return curve_points(of_kind("GUIDES")).reshape(len(of_kind("GUIDES").data.curves), -1, 3)


def bound():
    return addon().groom.bindings.of(of_kind("HAIR").data)


def strands():
    """Return (S, P, 3) positions as viewports show them, which may not be written yet."""
    if bound() is not None:
        return bound().shown.points.copy()
    return curve_points(of_kind("HAIR")).reshape(len(of_kind("HAIR").data.curves), -1, 3)


def are_in(rows, others):
    """Whether each row of (N, 41, 3) equals one of the others, to the last bit."""
    known = {row.tobytes() for row in others}
    return all(row.tobytes() in known for row in rows)


def groom():
    """Set up hair on a sphere with waved guides, an eighth of them selected in Sculpt Mode, and two empties as
    cutters.
    """
    install(ZIP)
    refine_to()
    remove_objects()
    with in_viewport():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=80, length=0.5, strand_count=500, radius=0.005)
    area, _region = viewport()
    area.spaces.active.region_3d.view_distance = 6.0
    for name, height in (("Lower", 0.8), ("Upper", 1.1)):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, None))
        bpy.data.objects[name].location.z = height
    yield from wait(0.5)
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    along = np.linspace(0.0, 1.0, 41)[:, None]
    combed = guides()
    waves = 0.1 * np.sin(9.0 * along + np.arange(len(combed))[:, None, None]) * np.roll(combed[:, :1], 1, axis=2)
    curves = of_kind("GUIDES").data
    curves.attributes["position"].data.foreach_set("vector", (combed + along * waves).astype(np.float32).ravel())
    selection = curves.attributes.new(".selection", "BOOLEAN", "CURVE")
    selection.data.foreach_set("value", (combed[:, 0] > 0.0).all(axis=1))
    curves.update_tag()
    bpy.data.objects["Upper"].select_set(True)  # what cuts, in a call from the menu
    yield from wait(1.0)
    with in_viewport():
        bpy.ops.ed.undo_push(message="Waved")


def use(name):
    """Use a tool, and note facts about guides and hair after each step."""
    before, hair_before = guides(), strands()
    is_chosen = (before[:, 0] > 0.0).all(axis=1)
    with in_viewport():
        bpy.ops.wm.call_menu(name="VELLUS_MT_guide_tools")
    yield
    yield from key("HOME")
    for _entry in range(MENU.index(name)):
        yield from key("DOWN_ARROW")
    if name == "smooth_guides":
        take_picture(OUT / "menu.png", redraws=2)
    count = len(bpy.context.window_manager.operators)
    yield from key("RET")
    # Kernels may be compiled first.
    yield from wait_for(lambda: len(bpy.context.window_manager.operators) > count)
    yield
    done = facts["tools"][name] = {"ran": bpy.context.window_manager.operators[-1].bl_idname}
    done["mode"], first = bpy.context.mode, guides()
    for setting, value in TOOLS[name].items():
        setattr(bpy.context.window_manager.operators[-1].properties, setting, value)
    with in_viewport():
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)  # what the redo panel does after a change
    yield from wait(0.2)
    after, hair_after = guides(), strands()
    kept = {
        "change_guide_count": before,
        "mirror_guides": before[before[:, 0, 0] > 0.0],
        "copy_guide_shape": before[is_chosen],
    }.get(name, before[~is_chosen])
    done["is redone"] = after.shape != first.shape or not np.array_equal(after, first)
    done["is changed"] = after.shape != before.shape or not np.array_equal(after, before)
    done["are others kept"] = are_in(kept, after) and are_in(kept, first)
    done["hair moved"] = float(np.abs(hair_after - hair_before).max())
    yield from key("Z", ctrl=True)
    yield from wait(0.2)
    done["is undone"] = bool(np.array_equal(guides(), before))
    done["hair after undo"] = float(np.abs(strands() - hair_before).max())
    yield from key("Z", ctrl=True, shift=True)
    yield from wait(0.2)
    done["is done again"] = bool(np.array_equal(guides(), after))
    done["hair after redo"] = float(np.abs(strands() - hair_after).max())
    yield from key("Z", ctrl=True)
    yield from wait(0.2)


def comb_straight():
    """Show styled hair without its style in Sculpt Mode and while a brush combs, and with its style afterwards.

    The guides are hidden at first; combing shows them.
    """
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.context.view_layer.objects.active = of_kind("HAIR")
        bpy.ops.vellus.add_style("EXEC_DEFAULT", True, style="CURL")
    yield from wait(1.0)
    styled = strands()
    of_kind("GUIDES").data.vellus.shows_styles_while_combing = False
    of_kind("GUIDES").hide_set(True)
    yield from wait(0.2)
    facts["were shown"] = of_kind("GUIDES").visible_get()
    with in_viewport():
        bpy.ops.vellus.comb_guides()
    yield from wait(1.0)
    facts["are shown"], facts["combing mode"] = of_kind("GUIDES").visible_get(), bpy.context.mode
    straight = strands()
    size = bpy.context.tool_settings.curves_sculpt.unified_paint_settings
    size.size = 150
    middle = places(guides()[:, 0]).mean(axis=0)
    followed = []
    for number, _pause in enumerate(drag(middle - np.array([150, 0]), middle + np.array([150, 0]))):
        yield
        if number == 10:  # the button is still held
            followed.append(float(np.abs(strands() - straight).max()))
            facts["is straight in the stroke"] = bound() is not None and bound().straight is not None
    yield from wait(1.0)
    facts["straightened"], facts["combed"] = float(np.abs(straight - styled).max()), followed
    take_picture(OUT / "straight.png", redraws=2)
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield from wait(1.0)
    facts["is styled again"] = bound() is None or bound().straight is None
    facts["styled again"] = float(np.abs(strands() - styled).max())
    take_picture(OUT / "styled.png", redraws=2)
    facts["status"] = of_kind("HAIR").data.vellus.status


def tools():
    for name in TOOLS:
        yield from use(name)


def resized(middle):
    """Change the radius of the brush by F and a click, and its strength by Shift F and Esc."""
    brush = bpy.context.workspace.tools.from_space_view3d_mode("OBJECT").operator_properties("vellus.paint_flow")
    done, values = facts["brush"], {}
    x, y = (int(value) for value in middle)
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    yield
    done["radius before"] = brush.radius / max(of_kind("GUIDES").data.surface.dimensions)
    take_picture(OUT / "brush.png", redraws=2)
    for name, shift in (("radius", False), ("strength", True)):
        yield from key("F", shift=shift)
        values[name] = getattr(brush, name)
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x + 60, y=y)
        yield from wait(0.2)
        done[f"{name} moved"] = getattr(brush, name) - values[name]
        if shift:
            yield from key("ESC")
        else:
            for value in ("PRESS", "RELEASE"):
                window().event_simulate(type="LEFTMOUSE", value=value, x=x + 60, y=y)
                yield
        yield from wait(0.2)
        done[f"{name} changed"] = getattr(brush, name) - values[name]
    brush.property_unset("radius")


def paint_flow():
    """Paint with the Paint Flow tool in Object Mode: a stroke, the redo panel, undo, and a stroke canceled by Esc."""
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.context.view_layer.objects.active = of_kind("HAIR")
        of_kind("GUIDES").data.attributes.remove(of_kind("GUIDES").data.attributes[".selection"])
        bpy.ops.ed.undo_push(message="Deselected")
        bpy.ops.wm.tool_set_by_id(name="vellus.paint_flow", space_type="VIEW_3D")
    yield from wait(0.5)
    before, followed = guides(), []
    _area, region = viewport()
    middle = np.array([region.x + 0.5 * region.width, region.y + 0.5 * region.height])
    reach = np.array([0.15 * region.height, 0.0])
    yield from resized(middle)
    for number, _pause in enumerate(drag(middle - reach, middle + reach)):
        yield
        if number == 10:  # the button is still held
            followed.append(float(np.abs(guides() - before).max()))
    yield from wait(0.5)
    after, last = guides(), bpy.context.window_manager.operators[-1]
    done = facts["flow"] = {"ran": last.bl_idname, "in the stroke": followed, "points": len(last.properties.stroke)}
    done["changed"] = int((after != before).any(axis=(1, 2)).sum())
    tool = bpy.context.workspace.tools.from_space_view3d_mode("OBJECT").operator_properties("vellus.paint_flow")
    done["radius"] = tool.radius / last.properties.radius
    take_picture(OUT / "flow.png", redraws=2)
    with in_viewport():
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
    done["is the same at once"] = float(np.abs(guides() - after).max())
    last.properties.strength = 0.0
    with in_viewport():
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
    done["without strength"] = bool(np.array_equal(guides(), before))
    yield from key("Z", ctrl=True)
    yield from wait(0.2)
    done["is undone"] = bool(np.array_equal(guides(), before))
    stroke = drag(middle - reach, middle + reach)
    for _event in range(8):
        next(stroke)
        yield
    done["second stroke"] = bool(np.array_equal(guides(), before))
    yield from key("ESC")
    yield from wait(0.2)
    done["is canceled"] = bool(np.array_equal(guides(), before))
    x, y = (int(value) for value in middle)
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)
    yield
    with in_viewport():
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box", space_type="VIEW_3D")


def made_of_it():
    yield from grooms.tubes(of_kind("HAIR"), facts["tubes"])
    yield from grooms.shelf(of_kind("HAIR"), OUT / "library", facts["shelf"])


def tie():
    """Draw a tie from the sphere to the empty space beside it, gather the guides there, and undo."""
    bpy.context.view_layer.objects.active = of_kind("GUIDES")
    before, done = guides(), facts["tie"]
    with in_viewport():
        bpy.ops.vellus.draw_tie("INVOKE_DEFAULT", True)
    yield from wait(0.3)
    drawn, (_area, region) = bpy.context.object, viewport()
    middle = np.array([region.x + 0.5 * region.width, region.y + 0.5 * region.height])
    yield from drag(middle, middle + np.array([0.35 * region.width, 0.0]))
    yield from wait(0.3)
    take_picture(OUT / "tie.png", redraws=2)
    with in_viewport():
        bpy.ops.vellus.draw_tie("INVOKE_DEFAULT", True)
    yield from wait(0.3)
    done["lines"] = [[list(point.co)[:3] for point in spline.points] for spline in drawn.data.splines]
    done["is stopped"] = bpy.context.object == of_kind("GUIDES") and bpy.context.mode == "OBJECT"
    with in_viewport():
        bpy.ops.vellus.gather_guides("INVOKE_DEFAULT", True)
    yield from wait(0.3)
    done["gathered"] = int((guides() != before).any(axis=(1, 2)).sum())
    yield from key("Z", ctrl=True)
    yield from wait(0.2)
    done["is undone"] = bool(np.array_equal(guides(), before))


PARTS = {"tools": (groom, tools, comb_straight), "drawn": (groom, paint_flow, made_of_it, tie)}
PARTS["all"] = (groom, tools, comb_straight, paint_flow, made_of_it, tie)


if __name__ == "__main__":
    take(PARTS[PART], pause=0.02)
