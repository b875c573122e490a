# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands stored as Blender's Curves are read as they were written, and Blender's own tools work on the Curves."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import attributes, curves
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.mesh import SurfacePoints
from tests.support.reading import attribute, points, vertex_positions

EXPECTED_ATTRIBUTES = {
    "position": ("FLOAT_VECTOR", "POINT"),
    "radius": ("FLOAT", "POINT"),
    "surface_uv_coordinate": ("FLOAT2", "CURVE"),
    "surface_normal": ("FLOAT_VECTOR", "CURVE"),
    "id": ("INT", "CURVE"),
}


def read_surface(surface_object):
    return scene.read_surface(surface_object, bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("kind", ["guides", "hair"])
def test_curves_carry_what_blender_expects(kind, request, sphere):
    made = request.getfixturevalue(kind)
    found = {a.name: (a.data_type, a.domain) for a in made.data.attributes}
    assert EXPECTED_ATTRIBUTES.items() <= found.items()
    assert made.type == "CURVES"
    assert made.data.surface == sphere and made.parent == sphere
    assert made.data.surface_uv_map == sphere.data.uv_layers.active.name
    assert made.matrix_local == Matrix()
    assert (attribute(made, "radius") > 0.0).all()
    assert len(set(attribute(made, "id"))) == len(made.data.curves)
    evaluated = made.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(attribute(evaluated, "rest_position", 3), points(made).reshape(-1, 3))


def test_written_points_reach_what_is_evaluated_and_no_copy(hair):
    """Written points reach the evaluated Curves, but no copy or undo step, although Blender shares arrays between
    them.
    """
    copy, before = hair.data.copy(), points(hair)
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(attribute(evaluated, "position", 3), before.reshape(-1, 3))
    curves.write_moved(hair.data, 3.0 * before)
    hair.data.update_tag()
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(attribute(evaluated, "position", 3), 3.0 * before.reshape(-1, 3))
    radius = attribute(hair, "radius").max()
    np.testing.assert_allclose(np.max(evaluated.bound_box, axis=0), 3.0 * before.max(axis=(0, 1)), atol=2.0 * radius)
    assert np.array_equal(curves.read_points(copy), before.reshape(-1, 3))
    with pytest.raises((ValueError, HairError)):
        curves.write_moved(hair.data, before[1:])


@pytest.mark.parametrize(("data_type", "domain"), [("FLOAT", "POINT"), ("FLOAT_VECTOR", "CURVE")])
def test_points_are_only_written_where_there_is_memory_for_them(hair, data_type, domain):
    hair.data.attributes.new("shape", data_type, domain)
    with pytest.raises(ValueError, match="points"):
        attributes.write_positions(hair.data, points(hair), "shape")


def test_roots_lie_on_the_surface_with_its_normal_and_uv(hair, sphere):
    roots = points(hair)[:, 0]
    normals = attribute(hair, "surface_normal", 3)
    # An icosphere of four subdivisions lies within half a per cent of the sphere, its smooth normals within a degree.
    np.testing.assert_allclose(np.linalg.norm(roots, axis=1), 1.0, atol=5e-3)
    np.testing.assert_allclose((normals * roots).sum(axis=1), 1.0, atol=5e-3)
    surface = read_surface(sphere)
    first = attribute(hair, "root_triangle")
    uvs = attribute(hair, "surface_uv_coordinate", 2)
    corners = surface.corner_uvs[first]
    assert (uvs >= corners.min(axis=1) - 1e-6).all() and (uvs <= corners.max(axis=1) + 1e-6).all()


def test_what_is_read_is_what_was_written(guides, sphere):
    surface = read_surface(sphere)
    first_points = surface.from_local(points(guides)[:, 0])
    roots = curves.read_roots(guides.data, surface, first_points)
    np.testing.assert_allclose(mesh_math.positions(surface.mesh, roots), first_points, atol=1e-6)
    assert np.array_equal(roots.triangle, attribute(guides, "root_triangle"))


def test_a_slid_guide_is_rooted_where_it_went(guides, sphere):
    surface = read_surface(sphere)
    first_points = surface.from_local(points(guides)[:, 0])
    first_points[7] = -first_points[7]
    roots = curves.read_roots(guides.data, surface, first_points)
    found = mesh_math.positions(surface.mesh, roots)
    np.testing.assert_allclose(found, first_points, atol=5e-3)


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 2, 2), (-1, 1, 1), (1, -2, 0.5), (1e-3, 1e-3, 1e-3), (1e3, 1e3, 1e3)])
def test_hair_stands_outwards_under_any_scale(sphere, scale):
    sphere.scale = scale
    sphere.location = (5.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    size = float(np.abs(scale).max())
    bpy.ops.vellus.distribute_guides(guide_count=40, length=0.1 * size, length_variation=0.0, tilt=0.0, gravity=0.0)
    made = bpy.data.objects["Guides"]
    bpy.context.view_layer.update()
    to_world = np.array(made.matrix_world)
    world = points(made) @ to_world[:3, :3].T
    lengths = np.linalg.norm(np.diff(world, axis=1), axis=-1).sum(axis=1)
    np.testing.assert_allclose(lengths, 0.1 * size, rtol=1e-3)
    outwards = (world[:, -1] - world[:, 0]) * world[:, 0]
    assert (outwards.sum(axis=1) > 0.0).all()


def test_a_radius_means_meters_whatever_the_scale(sphere):
    sphere.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    bpy.ops.vellus.distribute_guides(guide_count=20)
    bpy.ops.vellus.interpolate_hair(strand_count=50, radius=0.01)
    assert attribute(bpy.data.objects["Hair"], "radius").max() == pytest.approx(0.005, rel=1e-5)


def test_an_empty_list_of_strands_never_reaches_blender(guides):
    with pytest.raises(ValueError, match="no strands"):
        curves.make_strands(guides.data, None, SurfacePoints(np.empty(0, np.int32), np.empty((0, 3))), np.ones(41), ())


def test_moved_points_count_as_combed(guides):
    assert not curves.is_combed(guides.data)
    guides.data.attributes["position"].data[5].vector.x += 0.01
    assert curves.is_combed(guides.data)


def test_curves_of_mixed_point_counts_are_drawn_and_followed(guides):
    guides.data.resize_curves([9], indices=[3])
    bpy.ops.vellus.interpolate_hair(strand_count=100)
    assert np.isfinite(points(bpy.data.objects["Hair"])).all()


def test_hair_grows_without_a_uv_map(scene):
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    plane = bpy.data.objects.new("Plane", mesh)
    scene.collection.objects.link(plane)
    bpy.context.view_layer.objects.active = plane
    bpy.ops.vellus.distribute_guides(guide_count=10)
    made = bpy.data.objects["Guides"]
    assert len(made.data.curves) == 10 and made.data.surface_uv_map == ""
    assert vertex_positions(plane).shape == (4, 3)


def test_a_strand_keeps_its_random_number_when_there_are_more(hair):
    def by_root():
        numbers = curves.read_randoms(hair.data)
        return dict(zip(map(tuple, points(hair)[:, 0]), numbers, strict=True)), numbers

    by_root_before, before = by_root()
    assert 0.0 <= before.min() and before.max() <= 1.0
    assert before.std() == pytest.approx(12.0**-0.5, rel=0.05)  # evenly between 0 and 1
    bpy.ops.vellus.interpolate_hair(strand_count=900)
    assert len(hair.data.curves) == 900 and by_root_before.items() < by_root()[0].items()


@pytest.mark.parametrize("damage", ["missing", "another type", "not numbers"])
def test_random_numbers_are_numbers_whatever_the_file_holds(hair, damage):
    if damage == "not numbers":
        values = np.tile(np.array([np.nan, -3.0, np.inf, 0.25], np.float32), 125)
        hair.data.attributes["strand_random"].data.foreach_set("value", values)
    else:
        hair.data.attributes.remove(hair.data.attributes["strand_random"])
        if damage == "another type":
            hair.data.attributes.new("strand_random", "FLOAT_VECTOR", "POINT")
    found = curves.read_randoms(hair.data)
    assert found.shape == (500,) and (0.0 <= found).all() and (found <= 1.0).all()
    curves.write_randoms(hair.data)
    np.testing.assert_array_equal(curves.read_randoms(hair.data), found)
