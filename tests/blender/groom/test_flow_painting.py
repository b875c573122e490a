# SPDX-License-Identifier: GPL-3.0-or-later
"""Paint Flow turns guides along strokes on the surface as it is posed, and keeps them outside of it."""

from functools import partial
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from bpy_extras import view3d_utils
from mathutils import Matrix, Vector

from hair_addon import api
from hair_addon.blender.data.strands import curves, frozen_points
from hair_addon.blender.groom.guides import flow_painting
from hair_addon.blender.ui import brush_circle, tools
from hair_addon.blender.ui.operators.flow_painting import VELLUS_OT_paint_flow, VELLUS_OT_size_flow_brush
from hair_addon.core.errors import HairError
from hair_addon.core.grooming.guide_tool_settings import FlowSettings
from tests.support.interface.layout import draw, redo_panel
from tests.support.reading import evaluated_points, points

RADIUS = 0.5


@pytest.fixture
def guides(hair):
    """Make the guides of the sphere active, and return them."""
    found = bpy.data.objects["Guides"]
    bpy.context.view_layer.objects.active = found
    return found


def arc(reach=0.7, radius=1.0, side=0.3):
    """Return points of a stroke over the top of a sphere, from -X to +X, in the form that operators take."""
    angles = np.linspace(-reach, reach, 15)
    way = np.stack([np.sin(angles), np.full(15, side), np.cos(angles)], axis=1)
    return radius * way / np.linalg.norm(way, axis=1, keepdims=True)


def paint(stroke, **values):
    given = [{"name": "", "location": tuple(place)} for place in stroke]
    settings = {"radius": RADIUS, "strength": 1.0} | values
    assert bpy.ops.vellus.paint_flow("EXEC_DEFAULT", True, stroke=given, **settings) == {"FINISHED"}
    bpy.context.view_layer.update()
    return points(bpy.data.objects["Guides"])


def along_x(shape):
    """Return (G,) cosines between the leans of guides on the sphere and the direction of `arc`."""
    normals = shape[:, 0].astype(np.float64)
    lean = shape[:, -1] - normals
    lean -= np.sum(lean * normals, axis=1, keepdims=True) * normals
    flow = np.stack([normals[:, 2], np.zeros(len(normals)), -normals[:, 0]], axis=1)
    return np.sum(lean * flow, axis=1) / np.linalg.norm(lean, axis=1) / np.linalg.norm(flow, axis=1)


def segments(shape):
    return np.linalg.norm(np.diff(shape.astype(np.float64), axis=1), axis=2)


def distances(shape, stroke):
    return np.linalg.norm(shape[:, :1] - stroke[None], axis=2).min(axis=1)


def require_painted(before, after, stroke):
    away = distances(before, stroke)
    is_near = (away < 0.5 * RADIUS) & (np.abs(before[:, 0, 0]) < 0.45)
    assert is_near.sum() > 1 and along_x(after)[is_near].min() > 0.9 > along_x(before)[is_near].min()
    assert (along_x(after) > along_x(before) - 1e-6)[away < RADIUS].all()
    assert np.array_equal(after[away > RADIUS], before[away > RADIUS])
    assert np.array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(segments(after), segments(before), rtol=1e-4, atol=1e-6)
    assert np.linalg.norm(after[:, 1:], axis=2).min() > 0.993


@pytest.mark.parametrize("mode", ["OBJECT", "SCULPT_CURVES"])
def test_a_stroke_turns_guides_and_is_undone(guides, mode):
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="Before")
    before, strands = points(guides), points(bpy.data.objects["Hair"])
    after = paint(arc())
    require_painted(before, after, arc())
    assert not np.array_equal(points(bpy.data.objects["Hair"]), strands)
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), before)
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), after)
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("place", ["moved", "small", "mirrored"])
def test_strokes_have_the_same_effect_on_transformed_surfaces(guides, place):
    """In the coordinates of the surface, a stroke turns guides as it does without a transform."""
    sphere, before = bpy.data.objects["Sphere"], points(guides)
    alone = paint(arc())
    bpy.ops.ed.undo()
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    scale = {"moved": 1.0, "small": 0.01, "mirrored": 1.0}[place]
    turn = Matrix.Rotation(0.7, 4, "Z") @ Matrix.Rotation(0.4, 4, "X") if place == "moved" else Matrix.Identity(4)
    sphere.matrix_world = Matrix.Translation((3.0, 1.0, 2.0) if place == "moved" else (0.0, 0.0, 0.0)) @ turn
    sphere.scale = (-1.0, 1.0, 1.0) if place == "mirrored" else (scale, scale, scale)
    bpy.context.view_layer.update()
    before = points(guides)
    after = paint(arc(), radius=scale * RADIUS)
    require_painted(before, after, arc())
    np.testing.assert_allclose(after, alone, atol=2e-3)


def test_strokes_are_painted_on_the_posed_surface(guides):
    """A stroke on a sphere that a shape key enlarges and turns has its direction in the visible pose."""
    sphere, before = bpy.data.objects["Sphere"], points(guides)
    sphere.shape_key_add(name="Basis")
    key = sphere.shape_key_add(name="Large")
    for point in key.data:
        point.co = Matrix.Rotation(np.pi / 2.0, 3, "Z") @ (1.5 * point.co)
    key.value = 1.0
    bpy.context.view_layer.update()
    stroke = arc(radius=1.5)
    after = paint(stroke)
    posed = evaluated_points(guides)
    away = distances(posed, stroke)
    assert (away < 0.5 * RADIUS).any() and along_x(posed / 1.5)[away < 0.4 * RADIUS].min() > 0.93
    assert np.array_equal(after[away > RADIUS], before[away > RADIUS])
    np.testing.assert_allclose(segments(after), segments(before), rtol=1e-4, atol=1e-6)
    assert np.linalg.norm(posed[:, 1:], axis=2).min() > 1.485


def test_mirrored_strokes_paint_both_sides(guides):
    stroke = arc()[:, [1, 0, 2]] + [0.2, 0.0, 0.0]
    before = points(guides)
    after = paint(stroke, mirrored=True)
    is_changed = (after != before).any(axis=(1, 2))
    image = stroke * [-1.0, 1.0, 1.0]
    for side in (stroke, image):
        assert is_changed[distances(before, side) < 0.5 * RADIUS].all()
    both = np.minimum(distances(before, stroke), distances(before, image))
    assert np.array_equal(after[both > RADIUS], before[both > RADIUS])


def test_selected_guides_and_layers_take_the_stroke(guides):
    """The stroke turns only selected guides, and the active layer records it."""
    api.add_layer(guides)
    before = points(guides)
    chosen = before[:, 0, 1] > 0.2
    selection = guides.data.attributes.new(".selection", "BOOLEAN", "CURVE")
    selection.data.foreach_set("value", chosen)
    after = paint(arc())
    assert np.array_equal(after[~chosen], before[~chosen]) and (after[chosen] != before[chosen]).any()
    guides.data.vellus.layers[0].weight = 0.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(guides), before, atol=1e-6)


def test_frozen_points_stay_while_others_turn(guides):
    before = points(guides)
    frozen = np.zeros(before.shape[:2], bool)
    frozen[before[:, 0, 1] > 0.3] = True
    frozen_points.write(guides.data, frozen.ravel())
    after = paint(arc())
    assert np.array_equal(after[frozen], before[frozen])
    away = distances(before, arc())
    near = (away < 0.5 * RADIUS) & ~frozen.any(axis=1)
    assert near.any() and (after[near] != before[near]).any(axis=(1, 2)).all()


@pytest.mark.parametrize("kind", ["plain", "frozen", "counts", "posed", "small and mirrored"])
def test_events_of_a_stroke_have_the_result_of_the_whole_stroke(guides, kind, monkeypatch):
    """Each event turns only guides that its piece of the stroke reaches, to the bits of the stroke painted at once."""
    sphere, scale = bpy.data.objects["Sphere"], 0.01 if kind == "small and mirrored" else 1.0
    if kind == "frozen":
        frozen_points.write(guides.data, np.arange(len(guides.data.points)) % 41 < 7)
    elif kind == "counts":
        guides.data.resize_curves(sizes=[12, 30], indices=[0, 5])
    elif kind == "posed":
        sphere.shape_key_add(name="Basis")
        for point in sphere.shape_key_add(name="Turned", from_mix=False).data:
            point.co = Matrix.Rotation(0.5, 3, "Z") @ point.co
        sphere.data.shape_keys.key_blocks["Turned"].value = 1.0
    sphere.scale = (-scale, scale, scale) if scale != 1.0 else (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    guides.data.vellus.keeps_outside = True
    depsgraph, before = bpy.context.evaluated_depsgraph_get(), curves.read_points(guides.data)
    settings = FlowSettings(radius=0.3 * scale, strength=1.0, mirrored=kind == "plain")
    counts, real = [], flow_painting.grooming.painted_flow.turned_along

    def counted(points, *given):
        counts.append(len(points))
        return real(points, *given)

    monkeypatch.setattr(flow_painting.grooming.painted_flow, "turned_along", counted)
    stroke = flow_painting.FlowStroke(guides.data, settings, depsgraph)
    moved_counts = [stroke.extend(piece) for piece in np.split(arc(reach=1.2), 5)]
    by_events, per_event = curves.read_points(guides.data), sum(counts)
    stroke.restore()
    assert np.array_equal(curves.read_points(guides.data), before)
    counts.clear()
    at_once = flow_painting.FlowStroke(guides.data, settings, depsgraph)
    assert at_once.extend(arc(reach=1.2)) == moved_counts[-1] > 5
    assert np.array_equal(curves.read_points(guides.data), by_events)
    assert not np.array_equal(by_events, before) and per_event < sum(moved_counts)


def test_the_api_paints_as_the_operator_does(guides):
    after = paint(arc())
    bpy.ops.ed.undo()
    guides = bpy.data.objects["Guides"]
    assert api.paint_flow(guides, arc(), radius=RADIUS, strength=1.0) > 3
    np.testing.assert_allclose(points(guides), after, atol=1e-6)
    with pytest.raises(HairError, match="The stroke has no length"):
        api.paint_flow(guides, arc()[:1])
    with pytest.raises(HairError, match="non-finite"):
        api.paint_flow(guides, np.full((3, 3), np.nan))


@pytest.mark.parametrize("place", [Matrix.Scale(0.01, 4), Matrix.Diagonal((2.0, -0.5, 1.0, 1.0))])
def test_the_circle_of_the_brush_lies_on_the_surface(guides, place):
    """Points of the circle are at its radius in the world and in the tangent plane of the scaled surface."""
    surface = guides.data.surface
    surface.matrix_world = Matrix.Translation((1.0, 2.0, 3.0)) @ place
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    above, middle = (surface.matrix_world @ Vector((0.3, 0.2, height)) for height in (2.0, 0.0))
    ring = flow_painting.brush_circle(surface, above, middle - above, 0.7, depsgraph)
    hit = flow_painting.place_on(surface, above, middle - above, depsgraph)
    _hit, _place, normal, _face = surface.evaluated_get(depsgraph).closest_point_on_mesh(hit)
    from_middle = ring - np.array(surface.matrix_world @ Vector(hit))
    np.testing.assert_allclose(np.linalg.norm(from_middle, axis=1), 0.7, rtol=1e-5)
    outward = np.array(surface.matrix_world.inverted().transposed().to_3x3() @ normal)
    np.testing.assert_allclose(from_middle @ outward / np.linalg.norm(outward), 0.0, atol=2e-2)
    assert flow_painting.brush_circle(surface, above, above - middle, 0.7, depsgraph) is None


def test_the_brush_fits_the_surface_until_its_radius_is_set(guides):
    """Before the first stroke, the circle has the radius of the header, which shows the properties of the tool."""
    brush = bpy.context.window_manager.operator_properties_last("vellus.paint_flow")
    brush.property_unset("radius")
    fitted = flow_painting.default_radius(guides.data)
    assert brush.radius == pytest.approx(fitted) and not brush.is_property_set("radius") and fitted > 0.1
    bpy.data.objects["Sphere"].scale = (0.01, 0.01, 0.01)
    bpy.context.view_layer.update()
    assert brush.radius == pytest.approx(0.01 * fitted)
    brush.radius = 0.3
    assert brush.radius == pytest.approx(0.3)
    brush.property_unset("radius")


def test_the_circle_stays_while_its_radius_changes(guides, monkeypatch):
    """F keeps the circle where it began and returns the mouse there, whether the change is kept or canceled.

    The radius fits the surface until it is set, also after Esc.
    """
    drawn, warps = [], []
    monkeypatch.setattr(brush_circle, "circle", lambda _context, _guides, _brush, mouse: drawn.append(mouse))
    brush = bpy.context.window_manager.operator_properties_last("vellus.paint_flow")
    brush.property_unset("radius")
    fitted = brush.radius
    tool = SimpleNamespace(idname=tools.PAINT_FLOW, operator_properties=lambda _name: brush)
    context = SimpleNamespace(
        region=SimpleNamespace(x=20, y=10),
        region_data=True,
        object=guides,
        mode="OBJECT",
        area=SimpleNamespace(tag_redraw=lambda: None),
        window=SimpleNamespace(cursor_warp=lambda *place: warps.append(place)),
        window_manager=SimpleNamespace(modal_handler_add=lambda _operator: None),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        workspace=SimpleNamespace(tools=SimpleNamespace(from_space_view3d_mode=lambda _mode: tool)),
    )

    def event(kind, x, value="PRESS"):
        return SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=100)

    for last, factor in (("ESC", 1.0), ("LEFTMOUSE", 2.0), ("ESC", 2.0)):
        operator, is_set = SimpleNamespace(setting="radius"), brush.is_property_set("radius")
        for name in ("_end", "_restore"):
            setattr(operator, name, partial(getattr(VELLUS_OT_size_flow_brush, name), operator))
        VELLUS_OT_size_flow_brush.invoke(operator, context, event("F", 200))
        VELLUS_OT_size_flow_brush.modal(operator, context, event("MOUSEMOVE", 350, "NOTHING"))
        brush_circle.draw(context, brush, (350, 100))
        VELLUS_OT_size_flow_brush.modal(operator, context, event(last, 350))
        assert drawn.pop() == (180, 90) and warps.pop() == (200, 100)
        assert brush.radius == pytest.approx(factor * fitted)
        assert brush.is_property_set("radius") == (is_set or last == "LEFTMOUSE")
        brush_circle.draw(context, brush, (350, 100))
        assert drawn.pop() == (330, 90)
    brush.property_unset("radius")


def test_the_circle_is_drawn_where_the_view_shows_it():
    """Points have the places in the window to which Blender's own function projects them."""
    view = SimpleNamespace(perspective_matrix=Matrix(((1.2, 0, 0, 0), (0, 2.1, 0, 0), (0, 0, -1, -2), (0, 0, -1, 0))))
    region = SimpleNamespace(width=300, height=200, x=20, y=10)
    points = np.array([(0.1, 0.2, -3.0), (-1.0, 0.4, -2.0)])
    expected = [view3d_utils.location_3d_to_region_2d(region, view, Vector(p)) + Vector((20, 10)) for p in points]
    np.testing.assert_allclose(brush_circle.in_window(points, region, view), expected, rtol=1e-6)
    assert brush_circle.in_window(points * (1.0, 1.0, -1.0), region, view) is None


def test_guides_without_a_surface_are_refused(guides):
    """A press of the mouse and a script get a sentence, and no circle is drawn."""
    guides.data.surface = None
    refused = []
    operator = SimpleNamespace(refuse=lambda error: refused.append(str(error)), _place_of=lambda *_: None)
    VELLUS_OT_paint_flow.invoke(operator, bpy.context, None)
    assert refused == ['"Guides" has no surface: attach the guides to a mesh.']
    with pytest.raises(RuntimeError, match="The surface is missing"):
        paint(arc())
    context = SimpleNamespace(region=True, region_data=True, object=guides)
    assert brush_circle.draw(context, None, (0, 0)) is None


def test_the_tool_is_offered_in_its_modes(guides):
    """The panel, the menu and the toolbar offer the tool, whose header shows the settings of the redo panel."""
    from bl_ui.space_toolsystem_common import ToolSelectPanelHelper

    toolbar = ToolSelectPanelHelper._tool_class_from_space_type("VIEW_3D")
    for mode in tools.MODES:
        flat = ToolSelectPanelHelper._tools_flatten(toolbar._tools[mode])
        assert tools.PAINT_FLOW in [tool.idname for tool in flat if tool is not None]
    for cls in ("VELLUS_PT_guides_tools", "VELLUS_MT_guide_tools"):
        assert "Paint Flow" in draw(getattr(bpy.types, cls)).buttons
    assert {"radius", "strength", "lift", "mirrored"} <= set(redo_panel("paint_flow").drawn)
