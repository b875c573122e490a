# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on surfaces whose modifiers copy faces equals hair on the mesh with these modifiers applied."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix
from mathutils.bvhtree import BVHTree

from hair_addon.blender.data import rest_nodes
from hair_addon.blender.groom.systems import diagnostics
from tests.support.dynamics.following import grow, update
from tests.support.reading import evaluated_points, points, write_points


@pytest.fixture
def half(scene):
    """Return half of a ball of 2 m, at positive x."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    cut = bmesh.new()
    cut.from_mesh(ball.data)
    bmesh.ops.delete(cut, geom=[vertex for vertex in cut.verts if vertex.co.x < -1e-4], context="VERTS")
    cut.to_mesh(ball.data)
    cut.free()
    return ball


def mirror(surface):
    return surface.modifiers.new("Mirror", "MIRROR")


def solidify(surface):
    modifier = surface.modifiers.new("Solidify", "SOLIDIFY")
    modifier.thickness = 0.1
    return modifier


def grow_upright(surface):
    return grow(surface, guide_count=80, strand_count=300, gravity=0.0, tilt=0.0, length=0.4)


def into_surface(curves_object, surface):
    """Return the number of strands that start inward on an evaluated surface; neither object has a transform."""
    evaluated = surface.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    tree = BVHTree.FromPolygons([v.co.copy() for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons])
    evaluated.to_mesh_clear()
    count = 0
    for root, later in evaluated_points(curves_object)[:, [0, -1]]:
        _place, normal, _face, _distance = tree.find_nearest(root.tolist())
        count += (later - root) @ np.array(normal) < 0.0
    return count


@pytest.mark.parametrize("copying", [mirror, solidify])
def test_hair_is_that_of_the_applied_modifier(copying, half):
    modifier = copying(half)
    update()
    hair = [points(curves_object) for curves_object in grow_upright(half)]
    applied = half.copy()
    applied.data = half.data.copy()
    bpy.context.collection.objects.link(applied)
    for name in [one.name for one in applied.modifiers if one.name != modifier.name]:
        applied.modifiers.remove(applied.modifiers[name])
    applied.add_rest_position_attribute = False
    with bpy.context.temp_override(object=applied, active_object=applied, selected_objects=[applied]):
        bpy.ops.object.modifier_apply(modifier=modifier.name)
    update()
    for found, curves_object in zip(hair, grow_upright(applied), strict=True):
        np.testing.assert_allclose(found, points(curves_object), atol=2e-5)


@pytest.mark.parametrize("copying", [mirror, solidify])
def test_hair_stays_outside_where_faces_are_copied_later(copying, half):
    grown = grow_upright(half)
    copying(half)
    update()
    update()
    assert [into_surface(curves_object, half) for curves_object in grown] == [0, 0]


def test_both_sides_follow_an_armature(half):
    """All strands follow a mirrored half ball that a bone moves and turns across the mirror's plane."""
    mirror(half)
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    half.modifiers.new("Armature", "ARMATURE").object = rig
    half.vertex_groups.new(name="Bone").add(range(len(half.data.vertices)), 1.0, "REPLACE")
    update()
    grown = grow_upright(half)
    before = [evaluated_points(curves_object) for curves_object in grown]
    assert min((of[:, 0, 0] < -0.1).sum() for of in before) > 10
    turned = Matrix.Translation((0.3, 0.0, 0.5)) @ Matrix.Rotation(2.0, 4, "Z")
    rig.pose.bones[0].matrix = turned @ rig.pose.bones[0].matrix
    update()
    for of, curves_object in zip(before, grown, strict=True):
        moved = of @ np.array(turned.to_3x3()).T + np.array(turned.translation)
        np.testing.assert_allclose(evaluated_points(curves_object), moved, atol=1e-4)


def test_shape_keys_deform_both_sides_of_a_mirrored_mesh(half):
    half.shape_key_add(name="Basis")
    tall = half.shape_key_add(name="Tall")
    for vertex in tall.data:
        vertex.co.z *= 1.5
    tall.value = 0.0
    mirror(half)
    update()
    _guides, hair = grow_upright(half)
    stored = points(hair)
    before = evaluated_points(hair)[:, 0]
    tall.value = 1.0
    update()
    np.testing.assert_array_equal(points(hair), stored)
    np.testing.assert_allclose(evaluated_points(hair)[:, 0], before * (1.0, 1.0, 1.5), atol=1e-4)


def test_nodes_follow_the_last_modifier_that_copies_faces(half):
    mirror(half)
    update()
    grow_upright(half)

    def kinds():
        return [modifier.type for modifier in half.modifiers]

    assert kinds() == ["MIRROR", "NODES"]
    half.modifiers.new("Subdivision", "SUBSURF")
    solidify(half)
    update()
    assert kinds() == ["MIRROR", "SUBSURF", "SOLIDIFY", "NODES"]
    half.modifiers.remove(half.modifiers["Solidify"])
    update()
    assert kinds() == ["MIRROR", "NODES", "SUBSURF"]
    half.modifiers.remove(half.modifiers["Mirror"])
    update()
    assert kinds() == ["SUBSURF"]


def test_meshes_without_our_hair_are_left_alone(half):
    half.add_rest_position_attribute = True
    curves = bpy.data.hair_curves.new("Hair of Blender")
    curves.surface = half
    mirror(half)
    update()
    assert [modifier.type for modifier in half.modifiers] == ["MIRROR"]


def test_copies_of_deformed_faces_are_named(half):
    half.modifiers.new("Bend", "SIMPLE_DEFORM")
    copied = solidify(half)
    assert rest_nodes.lost_copies(half) == copied
    assert any('"Solidify"' in warning.text for warning in diagnostics.warnings_of(half, []))
    half.modifiers.move(1, 0)
    assert rest_nodes.lost_copies(half) is None


@pytest.mark.parametrize("copying", [mirror, solidify])
def test_hair_grows_on_the_copies_of_an_added_modifier_immediately(copying, half):
    """Hair regenerated on an added modifier's copies equals new hair on the mesh with the modifier, without another
    update.
    """
    bpy.ops.ed.undo_push(message="before")
    grow_upright(half)
    bpy.ops.ed.undo_push(message="grown")
    before = points(bpy.data.objects["Hair"])
    modifier = copying(half)
    modifier.show_viewport = True
    bpy.ops.ed.undo_push(message="modifier")
    update()
    added = points(bpy.data.objects["Hair"])
    bpy.ops.ed.undo()
    update()
    assert np.array_equal(points(bpy.data.objects["Hair"]), before)
    bpy.ops.ed.redo()
    update()
    assert np.array_equal(points(bpy.data.objects["Hair"]), added)
    half = bpy.data.objects["Sphere"]
    half.modifiers.remove(half.modifiers[0])
    update()
    assert np.array_equal(points(bpy.data.objects["Hair"]), before)
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    half = bpy.data.objects["Sphere"]
    assert "Hair" not in bpy.data.objects
    copying(half)
    grow_upright(half)
    assert np.abs(points(bpy.data.objects["Hair"]) - added).max() < 1e-6


def test_combed_guides_stay_and_their_hair_spreads_over_mirrored_faces(half):
    guides, hair = grow_upright(half)
    combed = points(guides) + np.float32([0.0, 0.0, 0.05]) * np.linspace(0.0, 1.0, 41, dtype=np.float32)[:, None]
    write_points(guides, combed)
    assert points(hair)[:, 0, 0].min() > -1e-3
    mirror(half)
    update()
    assert np.abs(points(guides) - combed).max() < 1e-6
    share = np.mean(points(hair)[:, 0, 0] < 0.0)
    assert 0.35 < share < 0.65
