# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed meshes with inward normals cause a warning and can be flipped; other meshes do not."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene, usable_surfaces
from hair_addon.blender.host import notices
from hair_addon.core.geometry.faces import orientation as sides
from tests.support.commands import TETRAHEDRON, run_here, write_obj
from tests.support.reading import points

SENTENCE = "is inside out: hair grows inward. Flip the normals of its mesh."


def add(kind, **size):
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**size)
    return bpy.context.object


MESHES = {
    "cube": lambda: add("cube"),
    "torus far away": lambda: far(add("torus")),
    "n-gons": lambda: add("cylinder", vertices=7),
    "monkey's open head": lambda: add("monkey"),
    "plane": lambda: add("plane"),
    "open cylinder": lambda: add("cylinder", end_fill_type="NOTHING"),
}


def far(mesh_object):
    for vertex in mesh_object.data.vertices:
        vertex.co.x += 1000.0
    mesh_object.data.update()
    return mesh_object


def is_mesh_closed(mesh):
    uses = np.zeros(len(mesh.edges), int)
    for loop in mesh.loops:
        uses[loop.edge_index] += 1
    return bool((uses == 2).all())


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-0.01, -0.02, -0.03)])
@pytest.mark.parametrize("kind", MESHES)
def test_only_closed_meshes_with_normals_inward_are_inside_out(blender_scene, kind, scale):
    """A mirrored object is inside out only if its mesh is, because its hair grows outward like that of an unmirrored
    object.
    """
    made = MESHES[kind]()
    made.scale = scale
    bpy.context.view_layer.update()
    assert not usable_surfaces.is_inside_out(made)
    made.data.flip_normals()
    made.data.update()
    bpy.context.view_layer.update()
    assert usable_surfaces.is_inside_out(made) == is_mesh_closed(made.data)


def test_the_volume_is_that_of_the_mesh(blender_scene):
    cube = add("cube", size=3.0)
    for sign in (1.0, -1.0):
        positions, faces = scene.vertex_positions(cube.data), scene.faces_of(cube.data)
        assert sides.signed_volume(positions + np.float32(50.0), faces) == pytest.approx(sign * 27.0)
        cube.data.flip_normals()


def test_flipping_lets_hair_grow_outward(blender_scene):
    ball = add("ico_sphere", subdivisions=3, radius=1.0)
    ball.data.flip_normals()
    ball.data.update()
    _guides, hair = api.add_hair(
        ball,
        api.GroomSettings(
            api.GuideSettings(guide_count=20, length=0.3, gravity=0.0), api.HairSettings(strand_count=60)
        ),
    )
    owner = next(o for o in bpy.data.objects if o.data == hair)
    assert np.linalg.norm(points(owner)[:, -1], axis=1).max() < 0.9
    bpy.context.view_layer.objects.active = owner
    bpy.ops.vellus.flip_normals()
    assert not usable_surfaces.is_inside_out(ball)
    assert np.linalg.norm(points(owner)[:, -1], axis=1).min() > 1.1
    roots = np.linalg.norm(points(owner)[:, 0], axis=1)
    assert 0.95 < roots.min() and roots.max() < 1.001


def test_scripts_and_commands_are_told(blender_scene, tmp_path, capfd):
    notices.printed_cache.clear()
    vertices, triangles = TETRAHEDRON
    for winding, is_told in ((1, False), (-1, True)):
        write_obj(tmp_path / "mesh.obj", vertices, triangles[:, ::winding])
        words = ("--guides", 4, "--strands", 8, "--out", tmp_path / "out.npz")
        ended = run_here("groom", tmp_path / "mesh.obj", *words)
        assert ended.status == 0 and (SENTENCE in ended.errors) == is_told
    api.distribute_guides(next(o for o in bpy.data.objects if o.type == "MESH"), guide_count=3)
    assert SENTENCE in capfd.readouterr().err
