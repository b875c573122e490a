# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawn meshes on the GPU: uploads after changes, and the effect of an object's matrix."""

from dataclasses import replace

import bpy
import gpu
import numpy as np
import pytest
from mathutils import Euler, Matrix

from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.gpu import surface_textures
from hair_addon.blender.render import drawn_surfaces, offscreen
from hair_addon.core.errors import HairError
from hair_addon.core.imaging.pixel_sampling import PictureSettings


@pytest.fixture
def ball(scene):
    """Return a smooth sphere before a camera, in the light of a sun."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.5)
    ball = bpy.context.object
    ball.data.shade_smooth()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -4.0, 0.0), (0.5 * np.pi, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (0.7, 0.4, 0.0), 3.0
    for one in (camera, sun):
        scene.collection.objects.link(one)
    scene.camera = camera
    return ball


@pytest.fixture
def floats(monkeypatch):
    """Return a list of the counts of numbers in each texture that is uploaded from now on."""
    sent, buffer = [], gpu.types.Buffer

    def counted(kind, size, values):
        if kind == "FLOAT":  # others are blocks of uniforms
            sent.append(int(np.prod(size)))
        return buffer(kind, size, values)

    monkeypatch.setattr(gpu.types, "Buffer", counted)
    return sent


def test_places_of_many_poses_are_kept_until_their_meshes_are_drawn(ball):
    """Hair uploads the poses of all surfaces of a frame before any of these surfaces is drawn."""
    (mesh,) = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get())
    meshes = [replace(mesh, owner=(uid, 0, ()), vertices=np.float32(uid) * mesh.vertices) for uid in range(1, 41)]
    drawn_surfaces.upload(meshes, is_shaded=True, has_paths=False)
    places = [surface_textures.posed_places(one.owner[0], one.vertices) for one in meshes]
    shown = drawn_surfaces.upload(meshes, is_shaded=True, has_paths=False)["surfaces"]
    assert [surface.places for surface, _parts in shown] == places


def surfaces():
    """Return [SurfaceOnGPU] of the scene as a render reads it."""
    bpy.context.view_layer.update()
    meshes = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get())
    shown = drawn_surfaces.upload(meshes, is_shaded=True, has_paths=False)
    return [surface for surface, _parts in (*shown["surfaces"], *shown["clear"])]


def test_a_pose_uploads_places_and_normals_of_vertices_and_a_turn_nothing(ball, floats):
    (first,) = surfaces()
    batches = first.corners.triangles, first.corners.texture
    floats.clear()
    for angle in (0.3, 0.6):
        ball.rotation_euler.z = angle
        (turned,) = surfaces()
        assert turned.places is first.places and turned.normals is first.normals
        assert turned.placed_shape != first.placed_shape
    assert not floats
    ball.data.vertices[7].co.x += 0.1
    ball.data.update()
    (posed,) = surfaces()
    assert len(floats) == 2 and max(floats) < 3 * (posed.vertex_count + posed.row_vertices)
    assert (posed.corners.triangles, posed.corners.texture) == batches
    floats.clear()
    (again,) = surfaces()
    assert not floats and again.placed_shape == posed.placed_shape


def test_another_topology_is_another_surface(ball):
    """A surface with other triangles or materials is another surface, also if its numbers of vertices and triangles are
    equal.
    """
    (first,) = surfaces()
    ball.data.flip_normals()
    (flipped,) = surfaces()
    assert flipped.corners is not first.corners and flipped.places is first.places
    ball.data.materials.append(bpy.data.materials.new("Other"))
    ball.data.materials[0].node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.1, 0.9, 0.2, 1.0)
    (colored,) = surfaces()
    assert colored.corners is not flipped.corners


def test_triangles_of_vertices_that_are_not_there_are_refused(scene):
    corners = np.zeros((3, 3), np.float32)
    for wrong in ([0, 1, 3], [-1, 1, 2]):
        with pytest.raises(HairError, match="out of range"):
            surface_textures.upload_surface(corners, np.array(wrong, np.int32))
    with pytest.raises(HairError, match="normals"):
        surface_textures.upload_surface(corners, np.arange(3, dtype=np.int32), corners[:2], has_vertex_normals=False)


def smooth(mesh):
    mesh.shade_smooth()


def flat(mesh):
    mesh.shade_flat()


def half_flat(mesh):
    mesh.polygons.foreach_set("use_smooth", np.arange(len(mesh.polygons)) % 2 == 0)


EVEN, MIRRORED, UNEVEN = (0.8, 0.8, 0.8), (-0.8, 0.8, 0.8), (1.2, -0.5, 0.8)


@pytest.mark.parametrize(
    ("shade", "scale"),
    [(smooth, EVEN), (smooth, MIRRORED), (half_flat, EVEN), (half_flat, MIRRORED), (flat, UNEVEN)],
)
def test_an_object_is_drawn_as_the_mesh_that_its_matrix_makes_of_it(ball, shade, scale):
    """Positions and normals of vertices, corners and faces follow any matrix."""
    shade(ball.data)
    ball.matrix_world = Matrix.LocRotScale((0.1, 0.2, -0.1), Euler((0.4, 0.3, 1.0)), scale)
    settings = PictureSettings(48, 48, 2)
    bpy.context.view_layer.update()
    placed = offscreen.draw_picture(settings)
    ball.data.transform(ball.matrix_world)
    if min(scale) < 0.0:
        ball.data.flip_normals()
    ball.matrix_world = Matrix.Identity(4)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(placed, offscreen.draw_picture(settings), atol=2e-3)
    assert np.ptp(placed[..., :3]) > 0.2
