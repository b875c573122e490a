# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow lines in Blender: guides start along curves drawn on the surface, and follow edits of the curves."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.core.errors import HairError
from tests.support.interface.layout import draw
from tests.support.reading import points, write_points


@pytest.fixture
def plane(scene):
    """Return a square of two meters that faces up; it is active."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=10, y_subdivisions=10, size=2.0)
    bpy.context.object.name = "Plane"
    return bpy.context.object


def spline(kind):
    """Return a curve object "Flow" from (-1, 0) to (1, 0) of a spline type."""
    places = np.array([(-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], np.float32)
    if kind == "CURVES":
        data = bpy.data.hair_curves.new("Flow")
        data.add_curves([3])
        data.attributes["position"].data.foreach_set("vector", places.ravel())
    elif kind == "MESH":
        data = bpy.data.meshes.new("Flow")
        data.from_pydata(places.tolist(), [(0, 1), (1, 2)], [])
    else:
        data = bpy.data.curves.new("Flow", "CURVE")
        data.dimensions = "3D"
        made = data.splines.new(kind)
        if kind == "BEZIER":
            made.bezier_points.add(2)
            for point, place in zip(made.bezier_points, places, strict=True):
                point.co = place
                point.handle_left_type = point.handle_right_type = "VECTOR"
        else:
            made.points.add(2)
            made.points.foreach_set("co", np.concatenate([places, np.ones((3, 1), np.float32)], axis=1).ravel())
    drawn = bpy.data.objects.new("Flow", data)
    bpy.context.scene.collection.objects.link(drawn)
    bpy.context.view_layer.update()
    return drawn


LIFT = np.radians(30.0)  # by default

STRAIGHT = {"guide_count": 40, "length": 0.3, "length_variation": 0.0, "tilt": 0.0, "gravity": 0.0}


def grow(**settings):
    bpy.context.view_layer.objects.active = bpy.data.objects["Plane"]
    bpy.ops.vellus.distribute_guides(**STRAIGHT, **settings)
    return bpy.data.objects["Guides"]


def directions(guides):
    steps = (points(guides)[:, 1] - points(guides)[:, 0]).astype(np.float64)
    return steps / np.linalg.norm(steps, axis=1, keepdims=True)


def expect(guides, x, y, lift=LIFT):
    wanted = (x * np.cos(lift), y * np.cos(lift), np.sin(lift))
    np.testing.assert_allclose(directions(guides), np.broadcast_to(wanted, (40, 3)), atol=3e-3)


@pytest.mark.parametrize("kind", ["POLY", "BEZIER", "NURBS", "CURVES", "MESH"])
def test_guides_begin_from_the_start_of_a_curve_to_its_end(plane, kind):
    spline(kind)
    expect(grow(flow_lines="Flow"), 1.0, 0.0)


def test_switching_the_direction_of_a_curve_turns_guides_around(plane):
    drawn = spline("BEZIER")
    guides = grow(flow_lines="Flow")
    before = points(guides)[:, 0]
    bpy.context.view_layer.objects.active = drawn
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="SELECT")
    bpy.ops.curve.switch_direction()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    expect(guides, -1.0, 0.0)
    np.testing.assert_array_equal(points(guides)[:, 0], before)  # roots stay


def test_guides_follow_a_curve_that_turns_and_their_hair_with_them(plane):
    drawn = spline("POLY")
    guides = grow(flow_lines="Flow")
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(strand_count=100)
    before = points(bpy.data.objects["Hair"])
    drawn.rotation_euler.z = np.pi / 2
    bpy.context.view_layer.update()
    expect(guides, 0.0, 1.0)
    assert np.abs(points(bpy.data.objects["Hair"])[:, -1] - before[:, -1]).max() > 0.1
    np.testing.assert_array_equal(points(bpy.data.objects["Hair"])[:, 0], before[:, 0])


def test_the_lift_and_the_choice_of_lines_are_settings_like_others(plane):
    spline("POLY")
    guides = grow()
    plain = points(guides)
    expect(guides, 0.0, 0.0, np.pi / 2)
    group = guides.data.vellus.guides
    group.flow_lines = "Flow"
    bpy.context.view_layer.update()
    expect(guides, 1.0, 0.0)
    group.lift = 1.0
    bpy.context.view_layer.update()
    expect(guides, 1.0, 0.0, 1.0)
    group.flow_lines = ""
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), plain)


def test_combed_guides_stay(plane):
    drawn = spline("POLY")
    guides = grow(flow_lines="Flow")
    combed = points(guides)
    combed[:, 1:] += (0.0, 0.0, 0.05)
    write_points(guides, combed)
    drawn.rotation_euler.z = 1.0
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), combed)


def test_an_unrelated_curve_moves_nothing(plane):
    spline("POLY")
    other = spline("POLY")
    guides = grow(flow_lines="Flow")
    before = points(guides)
    other.location.x = 0.3
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), before)
    assert not guides.data.vellus.is_stale


def test_a_moved_surface_with_its_lines_grows_the_same_guides(plane):
    drawn = spline("POLY")
    for owner in (plane, drawn):
        owner.location, owner.rotation_euler = (3.0, -2.0, 1.0), (0.0, 0.0, 0.7)
    bpy.context.view_layer.update()
    expect(grow(flow_lines="Flow"), 1.0, 0.0)  # in the surface's own axes


TURNED = {"location": (3.0, -2.0, 1.0), "rotation_euler": (0.4, 0.2, 0.7)}
PLACES = {
    "turned": TURNED,
    "small": {"scale": (0.01,) * 3},
    "uneven": {"scale": (0.5, 1.0, 2.0), **TURNED},
    "mirrored": {"scale": (-1.0, 1.0, 1.0)},
}


@pytest.mark.parametrize("place", PLACES)
def test_lines_of_a_surface_move_with_it_and_guides_stay(plane, place):
    drawn = spline("POLY")
    drawn.parent = plane
    bpy.context.view_layer.update()
    guides = grow(flow_lines="Flow")
    before = points(guides)
    for name, value in PLACES[place].items():
        setattr(plane, name, value)
    bpy.context.view_layer.update()
    drawn.name = "Flow lines"  # Blender reports the lines
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), before)


def test_guides_follow_lines_under_which_their_surface_turns(plane):
    """Turning the surface under lines that are not its children gives the same guides as turning the lines the other
    way.
    """
    drawn = spline("POLY")
    guides = grow(flow_lines="Flow")
    plane.rotation_euler.z = -np.pi / 2
    bpy.context.view_layer.update()
    expect(guides, 0.0, 1.0)
    before = points(guides)
    drawn.name = "Flow lines"
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), before)


def test_lines_are_drawn_on_the_surface_as_modifiers_leave_it(plane):
    """Guides follow a line drawn on a plane that a modifier has lifted by two meters."""
    drawn = spline("POLY")
    drawn.location.z = 2.0
    modifier = plane.modifiers.new("Up", "DISPLACE")
    modifier.strength, modifier.mid_level, modifier.direction = 2.0, 0.0, "Z"
    bpy.context.view_layer.update()
    expect(grow(flow_lines="Flow"), 1.0, 0.0)


def test_a_new_hair_system_takes_flow_lines(plane):
    spline("POLY")
    bpy.context.view_layer.objects.active = plane
    bpy.ops.vellus.add_hair(**STRAIGHT, strand_count=50, flow_lines="Flow", lift=0.3)
    expect(bpy.data.objects["Hair Guides"], 1.0, 0.0, 0.3)
    assert not bpy.data.objects["Hair Guides"].data.vellus.is_stale


@pytest.mark.parametrize(
    ("name", "words"), [("Lost", "no object"), ("Lamp", "cannot be used"), ("Points", "has no lines")]
)
def test_what_is_no_curve_is_refused_and_guides_are_kept(plane, name, words):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Points", bpy.data.meshes.new("Points")))
    with pytest.raises(HairError, match=words):
        api.distribute_guides(plane, guide_count=10, flow_lines=name)
    assert "Guides" not in bpy.data.objects
    guides = grow()
    before = points(guides)
    guides.data.vellus.guides.flow_lines = name
    bpy.context.view_layer.update()
    assert words in guides.data.vellus.status
    np.testing.assert_array_equal(points(guides), before)


def test_undo_brings_guides_back(plane):
    spline("POLY")
    guides = grow()
    bpy.ops.ed.undo_push(message="guides")
    before = points(guides)
    guides.data.vellus.guides.flow_lines = "Flow"
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="flow lines")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(bpy.data.objects["Guides"]), before)


def test_missing_flow_lines_are_reported_with_the_surface(plane):
    drawn = spline("POLY")
    guides = grow(flow_lines="Flow")
    bpy.context.view_layer.objects.active = plane

    def reported():
        return " ".join(draw(bpy.types.VELLUS_PT_surface).texts)

    assert "flow lines" not in reported()
    bpy.data.objects.remove(drawn)
    assert 'No object "Flow"' in reported() and "flow lines" in reported()
    guides.data.vellus.guides.flow_lines = ""
    assert "flow lines" not in reported()


def parted_plane():
    """Return guides between opposite flow lines at x = ±0.5, with hair, and a curve "Parting" along the y axis."""
    for name, lines in (("Flow", [((-0.5, -1), (-0.5, 1)), ((0.5, 1), (0.5, -1))]), ("Parting", [((0, -1), (0, 1))])):
        data = bpy.data.meshes.new(name)
        places = [(*place, 0.0) for line in lines for place in line]
        data.from_pydata(places, [(i, i + 1) for i in range(0, len(places), 2)], [])
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    bpy.context.view_layer.update()
    guides = grow(flow_lines="Flow", lift=0.0)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(strand_count=100)
    return guides


def sides(guides):
    """Return the largest difference of guides from the flow of their side."""
    own = np.sign(-points(guides)[:, 0, 0])[:, None] * (0.0, 1.0, 0.0)
    return np.abs(directions(guides) - own).max()


def test_part_lines_of_the_hair_divide_the_flow_of_its_guides(plane):
    guides = parted_plane()
    hair = bpy.data.objects["Hair"].data.vellus.hair
    plain = points(guides)
    assert sides(guides) > 0.5
    hair.part_lines = "Parting"
    bpy.context.view_layer.update()
    assert sides(guides) < 0.06  # guides that lie flat rise a little
    drawn = bpy.data.objects["Parting"]
    drawn.location.x = 0.6
    bpy.context.view_layer.update()
    moved = points(guides)
    assert sides(guides) > 0.5 and np.abs(moved - plain).max() > 0.05
    hair.part_lines = ""
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), plain)


def test_part_lines_leave_combed_guides(plane):
    guides = parted_plane()
    combed = points(guides)
    combed[:, 1:] += (0.0, 0.0, 0.05)
    write_points(guides, combed)
    bpy.context.view_layer.update()
    bpy.data.objects["Hair"].data.vellus.hair.part_lines = "Parting"
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(guides), combed)
    assert not guides.data.vellus.is_stale and guides.data.vellus.status == ""
