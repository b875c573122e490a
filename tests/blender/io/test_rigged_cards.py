# SPDX-License-Identifier: GPL-3.0-or-later
"""The armature of a rigged surface moves cards and tubes as it moves the surface at their roots."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.made import armature_weights
from tests.support.dynamics.following import update

CARDS = 24


@pytest.fixture
def rig(hair):
    """Add an armature to the hair's sphere, with a bone for each half and weights that change between them."""
    sphere = bpy.data.objects["Sphere"]
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name, side in (("left", -1.0), ("right", 1.0)):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = (0.0, 0.0, 0.0), (side, 0.0, 0.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, side in (("left", -1.0), ("right", 1.0)):
        group = sphere.vertex_groups.new(name=name)
        for vertex in sphere.data.vertices:
            group.add([vertex.index], float(np.clip(0.5 + side * vertex.co.x, 0.0, 1.0)), "REPLACE")
    modifier = sphere.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    bpy.context.view_layer.objects.active = next(o for o in bpy.data.objects if o.data == hair.data)
    update()
    return armature


def pose(rig, left, right):
    for name, value in (("left", left), ("right", right)):
        bone = rig.pose.bones[name]
        bone.rotation_mode, bone.rotation_euler = "XYZ", value
    update()


def places(mesh_object):
    mesh = mesh_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.ravel())
    return found


def make(kind, hair):
    if kind == "cards":
        (made,) = api.make_hair_cards(hair, card_count=CARDS, segment_count=3, texture_size=128)
        return made, 8
    return api.make_hair_tubes(hair, tube_count=CARDS, side_count=3, point_count=4), 12


@pytest.mark.parametrize("preserves_volume", [False, True])
@pytest.mark.parametrize("kind", ["cards", "tubes"])
def test_a_pose_moves_pieces_as_the_surface_at_their_roots(hair, rig, kind, preserves_volume):
    sphere = bpy.data.objects["Sphere"]
    sphere.modifiers["Armature"].use_deform_preserve_volume = preserves_volume
    made, size = make(kind, hair)
    update()
    roots = places(made).reshape(-1, size, 3)[:, :2].mean(axis=1)
    on_surface = [sphere.closest_point_on_mesh(root.tolist()) for root in roots]
    apart = np.linalg.norm(np.array([found[1] for found in on_surface]) - roots, axis=1)
    pose(rig, (0.0, 0.0, 0.0), (0.5, 0.3, -0.2))
    moved = places(made).reshape(-1, size, 3)[:, :2].mean(axis=1)
    shape, corners = places(sphere), [list(sphere.data.polygons[found[3]].vertices) for found in on_surface]
    centres = np.array([shape[own].mean(axis=0) for own in corners])
    rest = np.array([[sphere.data.vertices[i].co[:] for i in own] for own in corners]).mean(axis=1)
    motion, expected = moved - roots, centres - rest
    assert np.abs(expected).max() > 0.2
    np.testing.assert_allclose(motion, expected, atol=0.06 + apart.max())  # a face of the sphere is that large


@pytest.mark.parametrize("kind", ["cards", "tubes"])
def test_pieces_made_in_a_pose_are_where_the_hair_is_then(hair, rig, kind, monkeypatch):
    pose(rig, (0.2, 0.0, 0.4), (0.5, 0.3, -0.2))
    made, _size = make(kind, hair)
    with monkeypatch.context() as unbound:
        unbound.setattr(armature_weights, "bind", lambda *_: None)
        expected, _size = make(kind, hair)
    update()
    np.testing.assert_allclose(places(made), places(expected), atol=1e-5)


def test_pieces_made_in_a_pose_come_back_with_it(hair, rig):
    at_rest = places(make("tubes", hair)[0])
    pose(rig, (0.2, 0.0, 0.4), (0.5, 0.3, -0.2))
    made, _size = make("tubes", hair)
    pose(rig, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert np.median(np.abs(places(made) - at_rest)) < 0.02


def test_without_an_armature_nothing_is_added(hair):
    made, _size = make("tubes", hair)
    assert not made.modifiers and not made.vertex_groups
