# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps in a window: of a number of a style, added by a click on its button, painted, changed by a ramp, undone, redone;
and of the color, painted on its image.

Run by a desktop Blender as steps.py says. Strands are compared with those of hair without a map whose style has the
value at From or To.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    click,
    drag,
    in_viewport,
    install,
    key,
    of_kind,
    places,
    refine_to,
    remove_objects,
    sidebar,
    take_picture,
    viewport,
    wait,
    wait_for,
)

SETTING = "styles.Curl.root"  # the first row of the panel Root to Tip
LOW, HIGH = 0.25, 1.0  # its values where the map is 0 and 1

# Pixels from the upper right corner of a sidebar of the default width: the button of the first row of a panel.
BUTTON = (48, 47)

references = {}  # {value: (S, P, 3)} of hair without a map

RED, GREEN = (0.8, 0.02, 0.02), (0.1, 0.4, 0.1)


class OnlyPanel(bpy.types.Panel):
    """The rows of the panel Root to Tip of the style, alone in a tab of the sidebar."""

    bl_label, bl_idname = "Rows", "TEST_PT_rows"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Rows"

    def draw(self, _context):
        """Draw the rows of the first style."""
        addon().ui.setting_rows.profile_rows(addon().ui.panels.tab.split(self.layout), style())


def style():
    return of_kind("HAIR").data.vellus.styles[0]


def item(setting=SETTING):
    return next((one for one in of_kind("HAIR").data.vellus.maps if one.setting == setting), None)


def looks():
    """Return the absorption (S, 3) at roots as it is drawn, and as it is stored in the hair's Curves."""
    hair, maps = of_kind("HAIR").data, addon().data.maps.strand_maps
    stored = addon().data.strands.attributes.read(hair, maps.ROOT, "FLOAT_VECTOR", "CURVE")
    return maps.read_looks(hair).root.copy(), stored


def strands():
    """Return (S, P, 3) as they are now; they may not be written yet."""
    bound = addon().groom.bindings.of(of_kind("HAIR").data)
    bound.update_points()
    return bound.points.copy()


def weights():
    """Return (S, 3) weights of the painted group at the corners of the triangle of each root."""
    bound, surface = addon().groom.bindings.of(of_kind("HAIR").data), of_kind("HAIR").data.surface
    group = surface.vertex_groups[item().source].index
    of_vertices = addon().data.scene.weights_in_group(surface.data, group)
    return of_vertices[bound.surface.mesh.triangles[bound.binding.roots.triangle]]


def are_looks(wanted):
    return all(np.array_equal(found, wanted) for found in looks())


def note(name):
    """Note how many strands equal those of the values at From and at To, and whether they are in the right places."""
    found, corners = strands(), weights()
    is_low, is_high = (np.abs(found - references[value]).max(axis=(1, 2)) < 1e-6 for value in (LOW, HIGH))
    is_black, is_white = (corners == 0.0).all(axis=1), (corners == 1.0).all(axis=1)
    facts[name] = {
        "black": int(is_black.sum()),
        "white": int(is_white.sum()),
        "low": int(is_low.sum()),
        "low where black": int((is_low & is_black).sum()),
        "high where white": int((is_high & is_white).sum()),
    }
    return found


def groom():
    """Set up curls on a sphere, and note the strands without a map."""
    install(ZIP)
    refine_to()
    bpy.context.preferences.system.use_region_overlap = False
    remove_objects()
    with in_viewport():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=60, length=0.5, strand_count=400, radius=0.005)
        bpy.ops.vellus.add_style("EXEC_DEFAULT", True, style="CURL")
    style().curl.radius, style().curl.pitch = 0.05, 0.2
    area, _region = viewport()
    area.spaces.active.region_3d.view_distance = 3.5
    bpy.utils.register_class(OnlyPanel)
    area.spaces.active.show_region_ui = True
    yield from wait(0.5)
    sidebar().active_panel_category = "Rows"
    for value in (LOW, HIGH):
        style().curl.root = value
        bpy.context.view_layer.update()
        yield from wait_for(lambda: not of_kind("HAIR").data.vellus.is_stale)
        yield from wait(0.3)
        references[value] = strands()
    with in_viewport():
        bpy.ops.ed.undo_push(message="Curls")


def press_the_button():
    """Click the button of the setting: a map appears, in a popover, from which its kind is chosen."""
    panel = sidebar()
    yield from click(panel.x + panel.width - BUTTON[0], panel.y + panel.height - BUTTON[1])
    yield from wait_for(lambda: item() is not None)
    facts["clicked"] = item() is not None
    take_picture(OUT / "popover.png")
    yield from key("ESC")
    item().kind, item().low = "GROUP", LOW / HIGH
    yield from wait(0.2)
    with in_viewport():
        bpy.ops.ed.undo_push(message="Kind")


def paint():
    """Paint black over the middle of the sphere, with a stroke of the mouse in Weight Paint mode."""
    with in_viewport():
        bpy.ops.vellus.paint_map("EXEC_DEFAULT", True, setting=SETTING)
    yield from wait(0.3)
    facts["mode"] = bpy.context.mode
    note("white")
    settings = bpy.context.tool_settings.weight_paint
    settings.unified_paint_settings.size, settings.unified_paint_settings.use_unified_weight = 70, False
    settings.brush.weight, settings.brush.curve_distance_falloff_preset = 0.0, "CONSTANT"
    middle = places(np.zeros((1, 3)))[0]
    yield from drag(middle - np.array([40, 0]), middle + np.array([40, 0]), steps=6)
    yield from wait(0.5)
    painted = note("painted")
    take_picture(OUT / "painted.png")
    yield from key("Z", ctrl=True)
    yield from wait(0.3)
    note("undone")
    yield from key("Z", ctrl=True, shift=True)
    yield from wait(0.3)
    note("redone")
    facts["is redone"] = bool(np.array_equal(strands(), painted))


def change_the_ramp():
    """Add a ramp, which changes nothing at first, and turn it around; undo both."""
    before = strands()
    with in_viewport():
        bpy.ops.vellus.add_map_ramp("EXEC_DEFAULT", True, setting=SETTING)
    yield from wait(0.2)
    facts["same with a ramp"] = float(np.abs(strands() - before).max())
    with in_viewport():
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)  # what the redo panel does after a change
    yield from wait(0.2)
    facts["ramps"] = len({one.ramp_tree for one in of_kind("HAIR").data.vellus.maps})
    node = addon().settings.ramp_nodes.node_of(item().ramp_tree)
    curve = node.mapping.curves[0]
    for point, height in zip(curve.points, (1.0, 0.0), strict=True):
        point.location.y = height
    node.mapping.update()
    item().ramp_tree.update_tag()
    with in_viewport():
        bpy.ops.ed.undo_push(message="Ramp")
    yield from wait(0.5)
    found, corners = strands(), weights()
    is_low, is_high = (np.abs(found - references[value]).max(axis=(1, 2)) < 1e-5 for value in (LOW, HIGH))
    facts["turned"] = [
        int((is_low & (corners == 1.0).all(axis=1)).sum()),
        int((is_high & (corners == 0.0).all(axis=1)).sum()),
    ]
    for _undone in range(2):
        yield from key("Z", ctrl=True)
        yield from wait(0.3)
    facts["is without a ramp"] = item().ramp_tree is None
    facts["ramp undone"] = float(np.abs(strands() - before).max())


def interpolate_again():
    """Generate strands again with the redo panel: other strands have the values of the map."""
    with in_viewport():
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.context.view_layer.objects.active = of_kind("HAIR")
        bpy.ops.ed.undo_push(message="Object Mode")
        bpy.ops.vellus.interpolate_hair("INVOKE_DEFAULT", True)
    yield from wait(0.3)
    for count in (300, 400):
        bpy.context.window_manager.operators[-1].properties.strand_count = count
        with in_viewport():
            bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)
        yield from wait(0.3)
        facts[f"{count} strands"] = len(strands())
    note("again")
    facts["status"] = of_kind("HAIR").data.vellus.status


def paint_a_coat():
    """Paint red on the new image of a map of the color, with a stroke of the mouse; undo and redo."""
    look = of_kind("HAIR").data.vellus.appearance
    look.parametrization, look.color, look.random_color = "COLOR", GREEN, 0.0
    with in_viewport():
        bpy.ops.vellus.edit_map("EXEC_DEFAULT", True, setting="look.color")
        bpy.ops.vellus.paint_map("EXEC_DEFAULT", True, setting="look.color")
    yield from wait(1.0)
    facts["coat mode"] = bpy.context.mode
    before, _stored = looks()
    settings = bpy.context.tool_settings.image_paint
    unified = settings.unified_paint_settings
    unified.size, unified.use_unified_color, unified.use_unified_strength = 70, False, False
    settings.brush.color, settings.brush.strength = RED, 1.0
    middle = places(np.zeros((1, 3)))[0]
    yield from drag(middle - np.array([40, 0]), middle + np.array([40, 0]), steps=6)
    yield from wait(0.5)
    yield from wait_for(lambda: np.array_equal(*looks()))  # written after a pause
    painted, stored = looks()
    take_picture(OUT / "coat.png")
    facts["red"] = int(((painted[:, 0] < before[:, 0]) & (painted[:, 1] > before[:, 1])).sum())
    facts["green"] = int((painted == before).all(axis=1).sum())
    facts["is stored"] = bool(np.array_equal(painted, stored))
    for name, wanted, is_redo in (("undone", before, False), ("redone", painted, True)):
        yield from key("Z", ctrl=True, shift=is_redo)
        yield from wait_for(lambda wanted=wanted: are_looks(wanted))
        facts[f"coat {name}"] = are_looks(wanted)


if __name__ == "__main__":
    take((groom, press_the_button, paint, change_the_ramp, interpolate_again, paint_a_coat), pause=0.02)
