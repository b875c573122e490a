# SPDX-License-Identifier: GPL-3.0-or-later
"""Degenerate meshes, numbers and curves grow correct hair, or one message says why not."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene as scene_door
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import setting_properties
from hair_addon.core.errors import HairError
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.params import declared
from tests.support.reading import attribute, points, snapshot, write_points

NGON = [(math.cos(a), math.sin(a), 0.0) for a in np.linspace(0.0, 2.0 * math.pi, 50, endpoint=False)]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FAR = [(x + 5.0, y, z) for x, y, z in SQUARE]

# name: (vertices, faces, places that hair must not grow on or None)
MESHES = {
    "an n-gon": (NGON, [tuple(range(50))], None),
    "a concave face": ([*SQUARE, (0.5, 0.9, 0)], [(0, 1, 4, 2, 3)], None),
    "some faces without an area": (
        [*SQUARE, (2, 0, 0), (3, 0, 0), (4, 0, 0)],
        [(0, 1, 2, 3), (4, 5, 6)],
        lambda roots: roots[:, 0] > 1.01,
    ),
    "an edge of three faces": ([*SQUARE, (0, 0, 1), (1, 0, 1)], [(0, 1, 2, 3), (0, 1, 5, 4), (1, 0, 3)], None),
    "faces through each other": (
        [*SQUARE, (0.5, 0.5, -1), (0.5, 0.5, 1), (0.5, -0.5, 1)],
        [(0, 1, 2, 3), (4, 5, 6)],
        None,
    ),
    "two islands": ([*SQUARE, *FAR], [(0, 1, 2, 3), (4, 5, 6, 7)], lambda roots: abs(roots[:, 0] - 3.0) < 1.9),
    "a face twice": ([*SQUARE, *SQUARE], [(0, 1, 2, 3), (0, 1, 2, 3), (7, 6, 5, 4)], None),
    "a loose vertex far away": ([*SQUARE, (1e7, 0, 0)], [(0, 1, 2, 3)], lambda roots: roots[:, 0] > 1.01),
    "vertices in one place": (
        [*SQUARE, (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0)],
        [(0, 1, 2, 3), (4, 5, 6, 7)],
        None,
    ),
    "loose vertices": ([*SQUARE, (9, 9, 9)], [(0, 1, 2, 3)], lambda roots: roots[:, 0] > 1.01),
}


def make(vertices, faces, name="Odd"):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    bpy.context.view_layer.update()
    return made


def grow(**changes):
    """Return the new (guides, hair) objects on the active mesh."""
    arguments = {"guide_count": 12, "strand_count": 60, "relax_iterations": 3, "length": 0.1, **changes}
    assert bpy.ops.vellus.add_hair(**arguments) == {"FINISHED"}
    hair = bpy.context.object
    return next(o for o in bpy.data.objects if o.data == hair.data.vellus.guide_curves), hair


def lengths(curves_object):
    return np.linalg.norm(np.diff(points(curves_object), axis=1), axis=-1).sum(axis=1)


def refusal(operator, **arguments):
    before = snapshot()
    with pytest.raises(RuntimeError) as caught:
        operator(**arguments)
    assert snapshot() == before and "Traceback" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", MESHES)
def test_hair_grows_on_odd_meshes(scene, name):
    vertices, faces, forbidden = MESHES[name]
    make(vertices, faces)
    guides, hair = grow(length_variation=0.0, gravity=0.0)
    assert (len(guides.data.curves), len(hair.data.curves)) == (12, 60)
    np.testing.assert_allclose(lengths(guides), 0.1, rtol=1e-3)
    assert np.isfinite(points(hair)).all()
    assert forbidden is None or not forbidden(points(hair)[:, 0]).any()


@pytest.mark.parametrize("name", MESHES)
def test_triangles_are_those_that_blender_cuts(scene, name):
    odd = make(*MESHES[name][:2])
    odd.data.calc_loop_triangles()
    found = scene_door.read_surface(odd, bpy.context.evaluated_depsgraph_get()).mesh.triangles
    np.testing.assert_array_equal(found, [triangle.vertices[:] for triangle in odd.data.loop_triangles])


REFUSED = {
    "no vertices": ([], [], "no faces"),
    "vertices alone": (SQUARE, [], "no faces"),
    "no area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], [(0, 1, 2), (1, 2, 3)], "zero area"),
    "one place": ([(1, 1, 1)] * 4, [(0, 1, 2, 3)], "zero area"),
    "a coordinate that is no number": ([*SQUARE, (math.nan, 0, 0)], [(0, 1, 2, 3), (0, 1, 4)], "non-finite"),
    "an infinite coordinate": ([*SQUARE, (0, math.inf, 0)], [(0, 1, 2, 3), (0, 1, 4)], "non-finite"),
    "a size beyond all": ([(1e18 * x, 1e18 * y, z) for x, y, z in SQUARE], [(0, 1, 2, 3)], "check the object's scale"),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("operator", ["add_hair", "distribute_guides"])
def test_an_unusable_surface_is_reported(scene, name, operator):
    vertices, faces, sentence = REFUSED[name]
    make(vertices, faces)
    reported = refusal(getattr(bpy.ops.vellus, operator))
    assert sentence in reported and reported.count("\n") <= 1


@pytest.mark.parametrize("scale", [1e6, 3.7, 1e-6])
def test_hair_scales_with_its_surface(sphere, scale):
    """A head has the same hair if it is modeled in nanometers or in thousands of kilometers."""
    sphere.rotation_euler = (0.4, 0.0, 0.3)
    bpy.context.view_layer.update()
    expected = [points(curves_object) for curves_object in grow(length=0.3, gravity=0.0, angle_limit=math.pi)]
    bpy.ops.vellus.delete_hair()
    sphere.scale = (scale,) * 3
    bpy.context.view_layer.update()
    found = [points(curves_object) for curves_object in grow(length=0.3 * scale, gravity=0.0, angle_limit=math.pi)]
    for strands, others in zip(found, expected, strict=True):
        np.testing.assert_allclose(strands, others, atol=1e-5)


@pytest.mark.parametrize("rotation", [(0.4, 0.0, 0.3), (math.pi, 1.0, 0.0)])
@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_turning_a_surface_moves_no_root(sphere, rotation, curvature):
    """Turning a surface moves no root, although relaxation on the turned mesh would amplify rounding."""
    expected = [points(curves_object)[:, 0] for curves_object in grow(guide_count=100, curvature=curvature)]
    bpy.ops.vellus.delete_hair()
    sphere.rotation_euler = rotation
    bpy.context.view_layer.update()
    found = [points(curves_object)[:, 0] for curves_object in grow(guide_count=100, curvature=curvature)]
    for roots, others in zip(found, expected, strict=True):
        np.testing.assert_allclose(roots, others, atol=1e-6)


@pytest.mark.parametrize("scale", [(2, 2, 2), (-2, 2, 2), (2, 1, 1), (-1, 2, 1)])
def test_symmetric_guides_mirror_the_objects_own_axis(sphere, scale):
    """Symmetric guides mirror across the object's own axis, however it is turned and scaled."""
    sphere.rotation_euler, sphere.scale = (0.3, 0.2, 0.5), scale
    bpy.context.view_layer.update()
    bpy.ops.vellus.distribute_guides(guide_count=20, symmetric=True, relax_iterations=3, length=0.3)
    strands = points(bpy.data.objects["Guides"])
    np.testing.assert_allclose(strands[10:], strands[:10] * np.float32([-1, 1, 1]), atol=5e-3)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -2, 1), (-1, -1, -1)])
def test_hair_grows_outwards_on_a_mirrored_surface(sphere, scale):
    sphere.scale = scale
    bpy.context.view_layer.update()
    guides, hair = grow(gravity=0.0, tilt=0.0)
    for curves_object in (guides, hair):
        strands = points(curves_object)
        outwards = np.einsum("nc,nc->n", strands[:, -1] - strands[:, 0], strands[:, 0])
        assert (outwards > 0.0).all()
        normals = attribute(curves_object, "surface_normal", 3)
        assert (np.einsum("nc,nc->n", normals, strands[:, 0]) > 0.0).all()


def test_mirroring_a_surface_roots_nothing_anew(sphere):
    """A mirrored surface gives no new roots: its faces are the same, although wound the other way in the world."""
    guides, _hair = grow()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    before = scene_door.read_surface(sphere, depsgraph)
    sphere.scale.x = -1.0
    bpy.context.view_layer.update()
    after = scene_door.read_surface(sphere, bpy.context.evaluated_depsgraph_get())
    assert after.is_mirrored and after.topology == before.topology == guides.data.vellus.topology


def test_a_rotated_parent_bends_hair_by_the_worlds_gravity(sphere):
    """A rotated parent bends hair by the world's gravity: upside down, guides lean the other way in their
    coordinates.
    """
    upright = points(grow(gravity=1.0)[0])
    bpy.ops.vellus.delete_hair()
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.rotation_euler.x = math.pi
    sphere.parent = parent
    bpy.context.view_layer.update()
    turned = points(grow(gravity=1.0)[0])
    assert (upright[:, -1, 2] - upright[:, 0, 2]).mean() < 0.0 < (turned[:, -1, 2] - turned[:, 0, 2]).mean()


def test_two_objects_of_one_mesh_have_hair_of_their_own(sphere):
    twin = bpy.data.objects.new("Twin", sphere.data)
    bpy.context.scene.collection.objects.link(twin)
    _guides, hair = grow()
    bpy.context.view_layer.objects.active = twin
    _guides, other = grow(seed=7)
    assert (hair.data.surface, other.data.surface) == (sphere, twin)
    before = points(hair)
    other.data.vellus.hair.strand_count = 10
    bpy.context.view_layer.update()
    assert np.array_equal(points(hair), before) and len(other.data.curves) == 10


def test_without_a_uv_map_hair_grows(sphere):
    sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    _guides, hair = grow()
    assert hair.data.surface_uv_map == "" and np.isfinite(points(hair)).all()


@pytest.mark.parametrize("kind", ["SUBSURF", "DECIMATE", "MASK", "ARRAY"])
def test_hair_is_drawn_on_the_faces_that_a_modifier_makes(sphere, kind):
    _guides, hair = grow()
    modifier = sphere.modifiers.new("Change", kind)
    if kind == "DECIMATE":
        modifier.ratio = 0.3
    elif kind == "MASK":
        modifier.vertex_group = "top"
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == "" and np.isfinite(points(hair)).all()
    evaluated = sphere.evaluated_get(bpy.context.evaluated_depsgraph_get())
    for root in hair_cache.strands_on_gpu(hair.data).points[::6, 0]:
        found, nearest, _normal, _face = evaluated.closest_point_on_mesh(root)
        assert found and np.linalg.norm(np.array(nearest) - root) < 1e-3


def test_a_surface_that_becomes_non_finite_is_reported(sphere):
    """A surface that becomes non-finite is reported, its hair is not moved, and drawing does not crash Blender."""
    guides, hair = grow()
    before = points(hair)
    sphere.data.vertices[0].co.x = math.nan
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert "non-finite" in guides.data.vellus.status and np.array_equal(points(hair), before)
    sphere.data.vertices[0].co.x = 0.0
    sphere.data.vertices.add(1)  # other vertices than those that roots were found on, and no faces to them
    sphere.data.vertices[-1].co.x = math.nan
    sphere.modifiers.new("Subdivision", "SUBSURF")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    with pytest.raises(HairError, match="non-finite"):
        hair_cache.strands_on_gpu(hair.data)


def test_a_mask_that_leaves_nothing_keeps_hair(sphere):
    _guides, hair = grow()
    before = points(hair)
    sphere.vertex_groups.new(name="nothing")
    sphere.modifiers.new("Mask", "MASK").vertex_group = "nothing"
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert np.array_equal(points(hair), before)


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT"])
def test_hair_waits_until_a_mode_is_left(sphere, mode):
    _guides, hair = grow()
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.object.mode_set(mode=mode)
    hair.data.vellus.hair.strand_count = 20
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 60
    bpy.ops.object.mode_set(mode="OBJECT")
    hair.data.update_tag()
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 20


@pytest.mark.parametrize("guide_count", [1, 2, 500])
def test_any_number_of_guides_will_do(scene, guide_count):
    """Any number of guides works, from one for all hair to more than the mesh has faces."""
    make(SQUARE, [(0, 1, 2, 3)])
    guides, hair = grow(guide_count=guide_count)
    assert len(guides.data.curves) == guide_count
    assert len(np.unique(points(guides)[:, 0], axis=0)) == guide_count
    assert np.isfinite(points(hair)).all()


@pytest.mark.parametrize("distance", [0.0, -1.0, 1e-9, 1e5])
def test_any_influence_distance_will_do(guides, distance):
    """Any influence distance works: without guides in reach roots follow the nearest, and a huge one reaches all
    guides.
    """
    assert bpy.ops.vellus.interpolate_hair(strand_count=80, automatic_influence=False, influence_distance=distance) == {
        "FINISHED"
    }
    hair = bpy.data.objects["Hair"]
    assert np.isfinite(points(hair)).all() and lengths(hair).min() > 0.1


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0])
@pytest.mark.parametrize(("group", "settings_class"), [("guides", GuideSettings), ("hair", HairSettings)])
def test_unusual_property_values_grow_hair_or_are_reported(hair, group, settings_class, value):
    """Unusual property values from drivers or files grow finite hair or are reported."""
    hair.data.vellus.hair.automatic_influence = False
    for name, default, _details in declared(settings_class):
        if not isinstance(default, float):
            continue
        owner = bpy.data.objects["Guides" if group == "guides" else "Hair"]
        settings = getattr(owner.data.vellus, group)
        before = getattr(settings, name)
        setattr(settings, name, value)
        bpy.context.view_layer.update()
        for curves_object in (owner, hair):
            assert np.isfinite(points(curves_object)).all(), name
        if math.isnan(value):
            assert "must be" in owner.data.vellus.status, name
        setattr(settings, name, before)
    bpy.context.view_layer.update()
    assert owner.data.vellus.status == ""


@pytest.mark.parametrize("sizes", [(1, 1, 1), (2, 7, 41), (3, 300)])
def test_guides_of_any_point_counts_are_followed(sphere, sizes):
    """Guides with any point counts are followed, as drawn by an artist or made by another tool."""
    guides, _hair = grow(guide_count=len(sizes))
    first = points(guides)[:, 0]
    guides.data.remove_curves()
    guides.data.add_curves(list(sizes))
    places = np.concatenate(
        [root * (1.0 + np.linspace(0.0, 0.2, n))[:, None] for root, n in zip(first, sizes, strict=True)]
    )
    guides.data.attributes["position"].data.foreach_set("vector", places.astype(np.float32).ravel())
    guides.data.update_tag()
    bpy.context.view_layer.update()
    hair = bpy.data.objects["Hair"]
    assert hair.data.vellus.status == "", hair.data.vellus.status
    assert points(hair).shape == (60, 41, 3) and np.isfinite(points(hair)).all()


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_non_finite_combed_points_are_reported(hair, value):
    guides = bpy.data.objects["Guides"]
    before, combed = points(hair), points(guides)
    combed[3, 10] = value
    write_points(guides, combed)
    found = points(hair)
    assert np.isfinite(found).all()
    assert np.array_equal(found, before) == (not math.isfinite(value))
    assert bool(hair.data.vellus.status) == (not math.isfinite(value))


def test_all_points_in_one_place_are_followed(hair):
    guides = bpy.data.objects["Guides"]
    collapsed = points(guides)
    collapsed[:] = collapsed[:, :1]
    write_points(guides, collapsed)
    assert np.isfinite(points(hair)).all() and lengths(hair).max() < 1e-5


def test_hair_without_guides_left_keeps_what_it_has(hair):
    guides = bpy.data.objects["Guides"]
    before = points(hair)
    guides.data.remove_curves()
    guides.data.update_tag()
    bpy.context.view_layer.update()
    assert "no guides" in hair.data.vellus.status and np.array_equal(points(hair), before)


def test_a_file_whose_hair_is_no_curves_is_refused(guides):
    """A file whose hair is no Curves is refused, and numbers under our names are read through the settings' ranges."""
    state = guides.data.vellus
    state.guides["guide_count"] = -5
    with pytest.raises(Exception, match="Guide count must be"):
        setting_properties.to_settings(state.guides, GuideSettings)
