# SPDX-License-Identifier: GPL-3.0-or-later
"""Deformation of strands with a surface, and its inverse, for all or some strands with any point counts."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, posed_strands, stored_roots
from hair_addon.blender.io import strand_arrays
from tests.support.dynamics.following import drawn_points, grow


@pytest.fixture
def bent(arm, scene):
    """Return (guides, hair) on an arm that is bent to a right angle."""
    grown = grow(arm)
    scene.frame_set(11)
    return grown


def pose_of(curves_object):
    return posed_strands.read_pose(curves_object.data.surface, bpy.context.evaluated_depsgraph_get())


def at_rest(curves_object):
    """Return points (S, P, 3) at rest, the topology of their surface, and their roots."""
    datablock = curves_object.data
    stored = curves.read_points(datablock).reshape(len(datablock.curves), -1, 3)
    return stored, datablock.vellus.topology, stored_roots.places(datablock, np.inf)


def test_what_is_drawn_is_what_is_exported(bent):
    for curves_object in bent:
        exported = strand_arrays.world_points(curves_object.data)
        to_world = np.array(curves_object.matrix_world)
        np.testing.assert_allclose(
            drawn_points(curves_object) @ to_world[:3, :3].T + to_world[:3, 3], exported, atol=1e-6
        )


def test_some_strands_are_carried_as_all_are(bent):
    pose, (points, *rooted) = pose_of(bent[1]), at_rest(bent[1])
    chosen = np.arange(3, len(points), 7)
    every = pose.carry(points, *rooted)
    assert np.abs(every - points).max() > 0.2
    np.testing.assert_array_equal(pose.carry(points, *rooted, chosen), every[chosen])


def test_the_way_back_ends_where_strands_rest(bent):
    pose, (points, _topology, places) = pose_of(bent[0]), at_rest(bent[0])
    motion = pose.motion_at(places[0])
    there = posed_strands.carried(points, motion, places)
    np.testing.assert_allclose(posed_strands.carried(there, motion, places, is_back=True), points, atol=1e-5)


def test_strands_of_several_point_counts_are_carried_as_their_points_would_be(bent):
    pose, (points, _topology, places) = pose_of(bent[0]), at_rest(bent[0])
    counts = np.arange(len(points)) % 5 + 2
    kept = np.arange(points.shape[1]) < counts[:, None]
    motion = pose.motion_at(places[0])
    whole = posed_strands.carried(points, motion, places)
    np.testing.assert_array_equal(posed_strands.carried(points[kept], motion, places, counts), whole[kept])


def test_strands_whose_roots_are_lost_are_rooted_where_it_is_nearest(bent):
    pose, (points, topology, places) = pose_of(bent[1]), at_rest(bent[1])
    known, nearest = pose.carry(points, topology, places), pose.carry(points, topology, None)
    np.testing.assert_allclose(nearest, known, atol=1e-3)
    np.testing.assert_array_equal(pose.carry(points, "of another surface", places), nearest)


def test_where_it_is_nearest_is_a_matter_of_the_mesh_not_of_its_object_s_scale(hair):
    """The nearest place is found in the mesh's local coordinates, as by the nodes for renders, so a changed scale moves
    no strand.
    """
    surface, (points, *_rooted) = hair.data.surface, at_rest(hair)
    twist = surface.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    points += np.float32([0.0, 0.0, 0.5])  # beside the surface, as strands that were moved by hand
    carried = []
    for scale in ((1.0, 1.0, 1.0), (1.0, 3.0, 0.5)):
        surface.scale = scale
        bpy.context.view_layer.update()
        carried.append(pose_of(hair).carry(points, "of another surface", None))
    assert np.abs(carried[0] - points).max() > 0.2
    np.testing.assert_allclose(*carried, atol=1e-5)


def test_a_surface_at_rest_and_none_carry_nothing(hair):
    for surface in (hair.data.surface, None):
        pose = posed_strands.read_pose(surface, scene.present_depsgraph())
        points = curves.read_points(hair.data).reshape(500, -1, 3)
        np.testing.assert_array_equal(pose.carry(points, "", None), points)
