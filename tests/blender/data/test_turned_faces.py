# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair keeps its place on subdivided faces when Blender flips the faces of the cage by applying a mirroring scale."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.core.geometry.faces import flipped_faces
from tests.support.exchange.imported import select


def add_mesh(levels):
    """Return a mesh of faces with three to six corners and no symmetry, which a modifier subdivides."""
    mesh = bpy.data.meshes.new("Mixed")
    places = [(0, 0, 0), (2, 0, 0.3), (2.2, 1, 0), (0.1, 1.4, 0.2), (3, 0.4, 1), (3.1, 2, 0), (1, 3, 0.5), (-1, 2, 0)]
    faces = [(0, 1, 2, 3), (1, 4, 2), (4, 5, 2), (2, 5, 6, 7, 3), (0, 3, 7)]
    mesh.from_pydata([*places, (-1, -2, 1), (4, -1, 0)], [(8, 9)], [*faces, (1, 0, 7, 8, 9, 4)])
    body = bpy.data.objects.new("Mixed", mesh)
    bpy.context.collection.objects.link(body)
    body.modifiers.new("Subdivision", "SUBSURF").levels = levels
    body.scale = (-1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    return body


def evaluated(body):
    bpy.context.view_layer.update()
    mesh = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    return scene.vertex_positions(mesh), scene.faces_of(mesh)


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_subdivided_faces_are_as_before_their_cage_was_turned(blender, levels):
    body = add_mesh(levels)
    corner_count = len(body.data.loops)
    positions, faces = evaluated(body)
    select(body)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    turned_positions, turned = evaluated(body)
    assert not np.array_equal(faces.corner_vertices, turned.corner_vertices)
    found = flipped_faces.turned_cage(turned, corner_count)
    np.testing.assert_array_equal(found.before(turned.corner_vertices), faces.corner_vertices)
    np.testing.assert_allclose(turned_positions[found.vertices] * (-1, 1, 1), positions, atol=1e-5)
    back = flipped_faces.turned_cage(faces, corner_count)
    np.testing.assert_array_equal(back.corners[found.corners], np.arange(len(found.corners)))


def test_other_quads_are_none_of_a_cage(blender):
    body = add_mesh(1)
    _positions, faces = evaluated(body)
    assert flipped_faces.turned_cage(faces, 0) is None
    assert flipped_faces.turned_cage(faces, len(faces.corner_vertices)) is None
