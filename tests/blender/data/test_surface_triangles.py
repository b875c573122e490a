# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface has the same triangles in every pose, although Blender splits concave polygons differently."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene as scenes
from hair_addon.blender.data.strands import curves_objects

SQUARE = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]


@pytest.fixture
def concave(scene):
    """Return (a quad that a shape key makes concave, its evaluated mesh, its `Surface` without the key)."""
    mesh = bpy.data.meshes.new("Quad")
    mesh.from_pydata(SQUARE, [], [(0, 1, 2, 3)])
    surface = bpy.data.objects.new("Quad", mesh)
    scene.collection.objects.link(surface)
    surface.shape_key_add(name="Basis")
    key = surface.shape_key_add(name="Concave")
    key.data[1].co = (-0.5, 0.5, 0.0)
    curves_objects.store_rest_positions(surface)
    bpy.context.view_layer.update()
    at_rest = scenes.read_surface(surface, bpy.context.evaluated_depsgraph_get())
    key.value = 1.0
    bpy.context.view_layer.update()
    return surface, surface.evaluated_get(bpy.context.evaluated_depsgraph_get()).data, at_rest


def cut_by_blender(mesh):
    mesh.calc_loop_triangles()
    return [tuple(triangle.vertices) for triangle in mesh.loop_triangles]


@pytest.mark.parametrize("is_cut_before", [False, True], ids=["", "drawn before"])
def test_triangles_do_not_depend_on_the_pose(concave, is_cut_before):
    surface, evaluated, at_rest = concave
    if is_cut_before:
        cut_by_blender(evaluated)
    posed = scenes.read_surface(surface, bpy.context.evaluated_depsgraph_get())
    assert posed.is_deformed and posed.topology == at_rest.topology
    np.testing.assert_array_equal(posed.mesh.triangles, at_rest.mesh.triangles)
    np.testing.assert_array_equal(scenes.vertex_positions(evaluated), posed.posed)
    assert cut_by_blender(evaluated) != [tuple(triangle) for triangle in at_rest.mesh.triangles]  # in every pose
