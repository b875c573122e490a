# SPDX-License-Identifier: GPL-3.0-or-later
"""Between hair that is combed to two sides no strand points in between, with limits, regions or a part line."""

import math
import os
from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings, pipeline
from hair_addon.core.grooming import following, groom
from tests.support.pairs import pairs
from tests.support.reading import attribute, guide_map, points, write_points

LEAN = math.radians(60.0)
FREE = {"angle_limit": math.pi, "length_limit": 1e6}


@pytest.fixture
def ground(scene):
    """Return a square of one meter with 40 × 40 faces."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=40, size=1.0)
    return bpy.context.object


@pytest.fixture
def guides(ground):
    """Return 200 guides that lean by 60 degrees away from the plane x = 0, each to its own side; their object is
    active.
    """
    bpy.ops.vellus.distribute_guides(guide_count=200, length=0.2, length_variation=0.0, tilt=0.0, gravity=0.0)
    guides = bpy.data.objects["Guides"]
    comb(guides)
    bpy.context.view_layer.objects.active = guides
    return guides


def comb(guides, border=0.0):
    combed = points(guides)
    side = np.where(combed[:, 0, 0] > border, 1.0, -1.0)
    arms = np.stack([side * math.sin(LEAN), 0.0 * side, np.full(len(side), math.cos(LEAN))], axis=1)
    write_points(guides, combed[:, :1] + np.linspace(0.0, 0.2, combed.shape[1])[:, None] * arms[:, None])


def grown(**settings):
    """Return (S, P, 3), the points of hair between the active guides."""
    assert bpy.ops.vellus.interpolate_hair(strand_count=6000, **settings) == {"FINISHED"}
    return points(bpy.data.objects["Hair"])


def refusal(**settings):
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.vellus.interpolate_hair(strand_count=100, **settings)
    assert "Hair" not in bpy.data.objects
    return str(raised.value)


def in_between(strands):
    """Return the fraction of strands near the part line that lean less than three quarters as far as guides."""
    near = np.abs(strands[:, 0, 0]) < 0.05
    arms = strands[near, -1] - strands[near, 0]
    lean = np.arcsin(np.clip(np.abs(arms[:, 0]) / np.linalg.norm(arms, axis=1), 0.0, 1.0))
    return (lean < 0.75 * LEAN).mean()


def on_the_wrong_side(strands, border=0.0):
    return np.sign(strands[:, 0, 0] - border) != np.sign(strands[:, -1, 0] - strands[:, 0, 0])


def draw_line(*corners, name="Line", kind="POLY", cyclic=False):
    """Return a curve object through corners (x, y, z)."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    places = spline.bezier_points if kind == "BEZIER" else spline.points
    places.add(len(corners) - 1)
    for place, corner in zip(places, corners, strict=True):
        place.co = corner if kind == "BEZIER" else (*corner, 1.0)
        if kind == "BEZIER":
            place.handle_left_type = place.handle_right_type = "VECTOR"
    spline.use_cyclic_u = cyclic
    return linked(name, data)


def linked(name, data):
    line = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(line)
    bpy.context.view_layer.update()
    return line


def test_without_limits_a_third_points_in_between(guides):
    assert in_between(grown(**FREE)) > 0.3


def test_blenders_own_interpolation_points_in_between(guides, ground):
    """Blender's own interpolation makes strands point in between in this scene, so the scene tests partings."""
    folder = bpy.utils.system_resource("DATAFILES", path="assets/nodes")
    with bpy.data.libraries.load(os.path.join(folder, "procedural_hair_node_assets.blend"), link=False) as (_, wanted):
        wanted.node_groups = ["Interpolate Hair Curves"]
    modifier = guides.modifiers.new("Interpolate", "NODES")
    modifier.node_group = bpy.data.node_groups["Interpolate Hair Curves"]
    modifier.properties.inputs.Input_15.value = 6000.0  # density
    guides.update_tag()
    bpy.context.view_layer.update()
    native = guides.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(native.points), 3), np.float32)
    native.attributes["position"].data.foreach_get("vector", positions.ravel())
    assert in_between(positions.reshape(len(native.curves), -1, 3)) > 0.2


def test_limits_alone_part_hair(guides):
    """With limits alone, strands lean as far as their nearest guide."""
    strands = grown()
    assert in_between(strands) == 0.0
    arms = strands[:, -1] - strands[:, 0]
    np.testing.assert_allclose(np.abs(arms[:, 0]), 0.2 * math.sin(LEAN), rtol=1e-3)


@pytest.mark.parametrize("kind", ["vertex group", "points", "faces", "face sets", "guides"])
def test_regions_part_hair(guides, ground, kind):
    mesh, settings = ground.data, {"region_attribute": "side"} | FREE
    if kind == "vertex group":
        ground.vertex_groups.new(name="right").add([v.index for v in mesh.vertices if v.co.x > 0.001], 1.0, "REPLACE")
        settings = {"region_group": "right"} | FREE
        border = 0.0125  # halfway between vertices
    elif kind == "points":
        values = [7 if v.co.x > 0.001 else -3 for v in mesh.vertices]
        mesh.attributes.new("side", "INT", "POINT").data.foreach_set("value", values)
        border = 0.0125
    elif kind == "guides":
        values = [int(x > 0.0) for x in points(guides)[:, 0, 0]]
        guides.data.attributes.new("side", "INT", "CURVE").data.foreach_set("value", values)
        border = 0.0
    else:
        name = "side" if kind == "faces" else ".sculpt_face_set"
        settings["region_attribute"] = name
        mesh.attributes.new(name, "INT", "FACE").data.foreach_set(
            "value", [int(p.center.x > 0.0) for p in mesh.polygons]
        )
        border = 0.0
    comb(guides, border)
    strands = grown(**settings)
    assert in_between(strands) == 0.0
    if kind != "guides":  # strands are of their nearest guide's then
        assert not on_the_wrong_side(strands, border).any()


def test_regions_of_a_group_and_of_numbers_are_kept_apart_alike(guides, ground):
    ground.vertex_groups.new(name="back").add([v.index for v in ground.data.vertices if v.co.y > 0.001], 1.0, "REPLACE")
    sides = [int(p.center.x > 0.0) for p in ground.data.polygons]
    ground.data.attributes.new("side", "INT", "FACE").data.foreach_set("value", sides)
    grown(region_group="back", region_attribute="side", guide_map=True, **FREE)
    indices, weights = guide_map(bpy.data.hair_curves["Hair"])
    roots, its_roots = points(bpy.data.objects["Hair"])[:, 0], points(guides)[:, 0]
    for axis, border in ((0, 0.0), (1, 0.0125)):
        parts = (places[:, axis] > border for places in (its_roots, roots))
        of_guides, of_strands = parts
        assert np.all((of_guides[indices] == of_strands[:, None]) | (weights == 0.0))


LINES = {
    "poly": lambda: draw_line((0, -0.6, 0.01), (0, 0, -0.02), (0, 0.6, 0.01)),
    "bezier": lambda: draw_line((0, -0.5, 0.05), (0, 0.5, 0.05), kind="BEZIER"),
    "nurbs": lambda: draw_line(*((0, y, 0) for y in (-0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, 0.5)), kind="NURBS"),
    "closed": lambda: draw_line((0, -0.7, 0), (0, 0.7, 0), (2, 0.7, 0), (2, -0.7, 0), cyclic=True),
    "curves": lambda: drawn_curves([(0, -0.5, 0), (0, 0.2, 0), (0, 0.5, 0)]),
    "edges": lambda: drawn_edges([(0, 0.5, 0), (0, -0.1, 0), (0, -0.5, 0)], [(1, 2), (1, 0)]),
}


def drawn_curves(corners):
    data = bpy.data.hair_curves.new("Line")
    data.add_curves([len(corners)])
    data.attributes["position"].data.foreach_set("vector", np.float32(corners).ravel())
    return linked("Line", data)


def drawn_edges(corners, edges):
    data = bpy.data.meshes.new("Line")
    data.from_pydata(corners, edges, [])
    return linked("Line", data)


@pytest.mark.parametrize("kind", LINES)
def test_a_part_line_parts_hair(guides, kind):
    LINES[kind]()
    strands = grown(part_lines="Line", **FREE)
    assert in_between(strands) == 0.0
    assert not on_the_wrong_side(strands).any()


def test_a_part_line_is_where_it_is_in_the_world(guides, ground):
    """A part line acts where it is in the world, on a moved, rotated, scaled and mirrored surface, with any transform
    of its own.
    """
    ground.location, ground.rotation_euler, ground.scale = (3.0, -2.0, 5.0), (0.3, 0.2, 1.0), (-2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    ends = [ground.matrix_world @ (ground.data.vertices[0].co * 0 + type(ground.location)(end)) for end in ENDS]
    line = draw_line(*(tuple(end - type(end)((1.0, 1.0, 1.0))) for end in ends))
    line.location = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    strands = grown(part_lines="Line", **FREE)
    assert in_between(strands) == 0.0 and not on_the_wrong_side(strands).any()


ENDS = [(0.0, -0.5, 0.0), (0.0, 0.5, 0.0)]


def test_a_part_line_on_a_posed_surface_parts_it_at_rest(guides, ground):
    """A line drawn on a surface that a shape key has moved by one meter parts the hair at the same place at rest."""
    ground.shape_key_add(name="Basis")
    key = ground.shape_key_add(name="Key")
    for point in key.data:
        point.co = (point.co.x + 1.0, point.co.y, point.co.z)
    key.value = 1.0
    draw_line((1.0, -0.5, 0.0), (1.0, 0.5, 0.0))
    strands = grown(part_lines="Line", **FREE)
    assert in_between(strands) == 0.0 and not on_the_wrong_side(strands).any()


def test_hair_follows_its_part_line(guides):
    """A moved part line changes the parting; an update without movement computes nothing."""
    line = LINES["poly"]()
    grown(part_lines="Line", **FREE)
    hair = bpy.data.objects["Hair"]
    before = points(hair)
    line.location.x = 0.1
    bpy.context.view_layer.update()
    assert not np.array_equal(points(hair), before)
    comb(guides, 0.1)
    assert not on_the_wrong_side(points(hair), 0.1).any()
    bound = bindings.of(hair.data)
    line.location.z = 0.0
    line.update_tag()
    bpy.context.view_layer.update()
    assert bindings.of(hair.data) is bound


def test_hair_follows_its_part_line_on_a_moved_surface(guides, ground):
    """A part line that is a child of the surface moves with it, and no weights are computed; for other lines they
    are.
    """
    line = LINES["poly"]()
    line.parent = ground
    grown(part_lines="Line", **FREE)
    hair = bpy.data.objects["Hair"]
    before, bound = points(hair), bindings.of(hair.data)
    ground.rotation_euler.z, ground.location.y = 0.3, 0.2
    bpy.context.view_layer.update()
    assert bindings.of(hair.data) is bound
    np.testing.assert_array_equal(points(hair), before)
    line.parent = None
    ground.rotation_euler.z = ground.location.y = 0.0
    bpy.context.view_layer.update()
    comb(guides, 0.1)
    ground.location.x = -0.1
    bpy.context.view_layer.update()
    assert not on_the_wrong_side(points(hair), 0.1).any()


@pytest.mark.parametrize(("kind", "how"), pairs(LINES, ["hide_viewport", "hide_set", "unlinked"]))
def test_a_line_parts_hair_out_of_sight_too(guides, kind, how):
    line = LINES[kind]()
    strands = grown(part_lines="Line")
    key = bpy.data.hair_curves["Hair"].vellus.parting_key
    if how == "hide_set":
        line.hide_set(True)
    elif how == "hide_viewport":
        line.hide_viewport = True
    else:
        bpy.context.scene.collection.objects.unlink(line)
    bpy.context.view_layer.update()
    hair = bpy.data.objects["Hair"]
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.interpolate_hair(strand_count=6000, part_lines="Line") == {"FINISHED"}
    assert hair.data.vellus.parting_key == key
    np.testing.assert_array_equal(points(hair), strands)


def test_hair_follows_its_regions(guides, ground):
    numbers = ground.data.attributes.new("side", "INT", "FACE").data
    grown(region_attribute="side", **FREE)
    hair = bpy.data.objects["Hair"]
    assert in_between(points(hair)) > 0.3
    numbers.foreach_set("value", [int(p.center.x > 0.0) for p in ground.data.polygons])
    ground.data.update()
    bpy.context.view_layer.update()
    assert in_between(points(hair)) == 0.0


def test_hair_follows_the_regions_of_its_guides(guides):
    numbers = guides.data.attributes.new("side", "INT", "CURVE").data
    grown(region_attribute="side", **FREE)
    hair = bpy.data.objects["Hair"]
    assert in_between(points(hair)) > 0.3
    numbers.foreach_set("value", [int(x > 0.0) for x in points(guides)[:, 0, 0]])
    guides.data.update_tag()
    bpy.context.view_layer.update()
    assert in_between(points(hair)) == 0.0


# ---------------------------------------------------------------------------------------------------- the map


def test_the_guide_map_is_what_strands_follow(guides):
    grown(guide_map=True)
    hair = bpy.data.objects["Hair"]

    def assert_stored():
        bound = bindings.of(hair.data)
        expected = following.weights_now(bound.binding, bound.guides)
        indices, weights = guide_map(hair.data)
        np.testing.assert_array_equal(weights, expected.weights.numpy())
        np.testing.assert_array_equal(indices, np.where(weights > 0.0, expected.indices.numpy(), -1))
        leaders = attribute(hair, "guide_curve_index")
        np.testing.assert_array_equal(indices[leaders, 0], indices[:, 0])

    assert_stored()
    _, before = guide_map(hair.data)
    comb(guides, 0.1)  # shapes change, and limits with them
    assert_stored()
    assert not np.array_equal(guide_map(hair.data)[1], before)


def test_the_guide_map_survives_a_file(guides, tmp_path):
    grown(guide_map=True)
    stored = guide_map(bpy.data.hair_curves["Hair"])
    path = str(tmp_path / "map.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    for array, expected in zip(guide_map(bpy.data.hair_curves["Hair"]), stored, strict=True):
        np.testing.assert_array_equal(array, expected)


def test_the_guide_map_has_as_many_slots_as_are_wanted(guides):
    grown(neighbour_limit=5, guide_map=True)
    hair = bpy.data.hair_curves["Hair"]
    assert guide_map(hair)[0].shape == (6000, 5)
    hair.vellus.hair.neighbour_limit = 3
    bpy.context.view_layer.update()
    assert guide_map(hair)[0].shape == (6000, 3)
    hair.vellus.hair.guide_map = False
    bpy.context.view_layer.update()
    assert guide_map(hair) is None
    assert not [a.name for a in hair.attributes if a.name.startswith(("guide_index", "guide_weight"))]


# ------------------------------------------------------------------------------------------------ what is wrong


def face_set(name, data_type, domain):
    return lambda ground: ground.data.attributes.new(name, data_type, domain)


REFUSED = {
    "no object": (lambda _: None, {"part_lines": "Lost"}, 'no object "Lost"'),
    "no line": (
        lambda _: linked("Line", bpy.data.lights.new("Line", "SUN")),
        {"part_lines": "Line"},
        "cannot be used as lines",
    ),
    "no points": (
        lambda _: linked("Line", bpy.data.curves.new("Line", "CURVE")),
        {"part_lines": "Line"},
        "has no lines",
    ),
    "one point": (lambda _: draw_line((0, 0, 0)), {"part_lines": "Line"}, "has no lines"),
    "one point of new curves": (lambda _: drawn_curves([(0, 0, 0)]), {"part_lines": "Line"}, "has no lines"),
    "no new curves": (
        lambda _: linked("Line", bpy.data.hair_curves.new("Line")),
        {"part_lines": "Line"},
        "has no lines",
    ),
    "a surface": (lambda _: None, {"part_lines": "Grid"}, "has no lines"),
    "non-finite": (lambda _: draw_line((0, 0, math.nan), (1, 0, 0)), {"part_lines": "Line"}, "non-finite"),
    "hair": (lambda _: None, {"part_lines": "Guides"}, "cannot be used as lines"),
    "no group": (lambda _: None, {"region_group": "Lost"}, 'no vertex group "Lost"'),
    "no attribute": (lambda _: None, {"region_attribute": "Lost"}, 'attribute "Lost"'),
    "wrong type": (face_set("a", "FLOAT", "FACE"), {"region_attribute": "a"}, "integers on faces or vertices"),
    "wrong domain": (face_set("a", "INT", "CORNER"), {"region_attribute": "a"}, "integers on faces or vertices"),
    "angle": (lambda _: None, {"angle_limit": math.nan}, "Parting angle must be"),
    "length": (lambda _: None, {"length_limit": math.nan}, "Parting length ratio must be"),
    "keep": (lambda _: None, {"keep_length": math.nan}, "Preserve length must be"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_invalid_partings_are_refused(guides, ground, case):
    make, settings, words = REFUSED[case]
    make(ground)
    reported = refusal(**settings)
    assert words in reported and reported.count("\n") <= 1


def test_a_line_that_goes_missing_leaves_the_hair(guides):
    line = LINES["poly"]()
    strands = grown(part_lines="Line")
    bpy.data.objects.remove(line)
    bpy.context.view_layer.update()
    hair = bpy.data.objects["Hair"]
    hair.data.vellus.hair.neighbour_limit = 4
    bpy.context.view_layer.update()
    assert np.array_equal(points(hair), strands)
    assert "Line" in hair.data.vellus.status


def test_a_file_from_before_has_the_defaults(guides, tmp_path):
    grown()
    hair = bpy.data.hair_curves["Hair"]
    stored = hair.bl_system_properties_get()["vellus"]["hair"]
    for name in ("angle_limit", "length_limit", "keep_length", "part_lines", "guide_map"):
        if name in stored:
            del stored[name]
    path = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    hair = bpy.data.hair_curves["Hair"]
    _, settings = pipeline.inputs_of(hair)
    found = {name: getattr(hair.vellus.hair, name) for name in ("radius", "influence_distance")}  # by the surface
    assert replace(settings, **found) == replace(groom.HairSettings(strand_count=6000), **found)
