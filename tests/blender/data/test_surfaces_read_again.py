# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces and meshes that are read again reuse unchanged data, with the same result as a first reading."""

from dataclasses import replace

import bmesh
import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.data.strands import posed_strands
from hair_addon.blender.render import hair_cache


@pytest.fixture
def ball(scene):  # an empty one
    """Return a sphere of quads with a UV map, rest positions, a shape key and two materials."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    made = bpy.context.object
    made.add_rest_position_attribute = True
    made.shape_key_add(name="Basis")
    key = made.shape_key_add(name="Bent")
    key.value = 0.0
    for point in key.data:
        point.co.x += point.co.z**2
    for name in ("First", "Second"):
        made.data.materials.append(bpy.data.materials.new(name))
    made.data.polygons.foreach_set("material_index", np.arange(len(made.data.polygons)) % 2)
    return made


def pose(ball):
    ball.data.shape_keys.key_blocks["Bent"].value += 0.5


def move_rest(ball):
    for block in ball.data.shape_keys.key_blocks:
        block.data[0].co.z += 0.5


def subdivide(ball):
    ball.modifiers.new("Subdivision", "SUBSURF").levels = 1


def subdivide_flat(ball):
    ball.modifiers.new("Subdivision", "SUBSURF").subdivision_type = "SIMPLE"


def turn_faces(ball):
    ball.data.flip_normals()


def move_uvs(ball):
    ball.data.uv_layers.active.uv[3].vector = (0.25, 0.75)


def rename_uvs(ball):
    ball.data.uv_layers.active.name = "Other"


def remove_uvs(ball):
    ball.data.uv_layers.remove(ball.data.uv_layers.active)


def scale(ball):
    ball.scale = (1.0, 2.0, 1.0)


def mirror(ball):
    ball.scale.x *= -1.0


def rename(ball):
    ball.name = "Other"


def forget_rest(ball):
    ball.add_rest_position_attribute = False


def paint_faces(ball):
    ball.data.polygons.foreach_set("material_index", np.arange(len(ball.data.polygons)) // 20 % 2)


def cut_otherwise(ball):
    """Turn two triangles into a quad and a quad into two triangles, which keeps the numbers of polygons and corners."""
    edited = bmesh.new()
    edited.from_mesh(ball.data)
    shared = next(e for e in edited.edges if [len(face.verts) for face in e.link_faces] == [3, 3])
    cut = next(face for face in edited.faces if len(face.verts) == 4)
    bmesh.utils.face_split(cut, cut.verts[0], cut.verts[2])
    bmesh.utils.face_join(shared.link_faces)
    edited.to_mesh(ball.data)
    edited.free()


CHANGES = [pose, move_rest, subdivide, subdivide_flat, turn_faces, move_uvs, rename_uvs, remove_uvs, scale, mirror]
CHANGES += [rename, forget_rest, paint_faces, cut_otherwise, pose]


def depsgraph_of(ball):
    ball.data.update_tag()
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def same_surfaces(one, other):
    return one.is_same(other) and np.array_equal(one.smooth_rest, other.smooth_rest) and one.topology == other.topology


def test_surfaces_are_as_if_read_for_the_first_time(ball):
    for change in CHANGES:
        scene.read_surface(ball, depsgraph_of(ball)).topology  # noqa: B018 (kept with the surface)
        change(ball)
        depsgraph = depsgraph_of(ball)
        again = scene.read_surface(ball, depsgraph)
        scene.surface_cache.clear()
        scene.faces_cache.clear()
        assert same_surfaces(again, scene.read_surface(ball, depsgraph)), change.__name__


def test_vertices_at_rest_are_checked_once_for_all_poses(ball, monkeypatch):
    """Poses are copies of the surface that was read first, so what they compute themselves is lost."""
    surface, checked, real = scene.read_surface(ball, depsgraph_of(ball)), [], np.isfinite
    monkeypatch.setattr(np, "isfinite", lambda values: checked.append(values) or real(values))
    for amount in (1.1, 1.2, 1.3):
        posed_strands.pose_of(surface.posed_at(np.float32(amount) * surface.rest))
    assert sum(values is surface.rest for values in checked) == 1


def test_poses_without_uvs_follow_all_other_changes(ball):
    """Surfaces that are read without UVs have all other changes, and no UVs of before; later readings have the UVs."""
    for change in CHANGES:
        scene.read_surface(ball, depsgraph_of(ball))
        change(ball)
        depsgraph = depsgraph_of(ball)
        bare, again = scene.read_surface(ball, depsgraph, False), scene.read_surface(ball, depsgraph)
        scene.surface_cache.clear()
        scene.faces_cache.clear()
        new = scene.read_surface(ball, depsgraph)
        assert bare.corner_uvs is None or np.array_equal(bare.corner_uvs, new.corner_uvs), change.__name__
        assert same_surfaces(again, new), change.__name__
        bare, new = (replace(one, corner_uvs=None, uv_map="") for one in (bare, new))
        assert same_surfaces(bare, new), change.__name__


def test_meshes_that_move_are_drawn_as_if_read_for_the_first_time(ball):
    """Moving meshes are drawn as if read for the first time, except for the diagonals of quads."""
    for change in CHANGES:
        drawn_meshes.read_drawn_meshes(depsgraph_of(ball))
        change(ball)
        depsgraph = depsgraph_of(ball)
        (again,) = drawn_meshes.read_drawn_meshes(depsgraph, is_moving=True)
        scene.faces_cache.clear()
        (new,) = drawn_meshes.read_drawn_meshes(depsgraph)
        assert again.parts == new.parts, change.__name__
        for first, count, _material in again.parts:
            corners = [np.unique(mesh.positions[first : first + count], axis=0) for mesh in (again, new)]
            assert np.array_equal(*corners), change.__name__


def test_a_pose_cuts_no_polygons(ball, monkeypatch):
    first = scene.read_surface(ball, depsgraph_of(ball))
    drawn_meshes.read_drawn_meshes(depsgraph_of(ball), is_moving=True)
    cut, real = [], scene.triangle_corners
    monkeypatch.setattr(scene, "triangle_corners", lambda *given: cut.append(1) or real(*given))
    pose(ball)
    depsgraph = depsgraph_of(ball)
    second = scene.read_surface(ball, depsgraph)
    drawn_meshes.read_drawn_meshes(depsgraph, is_moving=True)
    assert not cut and second.mesh is first.mesh
    assert second.is_deformed and not first.is_deformed
    drawn_meshes.read_drawn_meshes(depsgraph)  # at rest
    assert len(cut) == 1


@pytest.mark.parametrize("is_divided", [True, False])
def test_hair_of_a_file_that_was_saved_in_edit_mode_is_drawn(ball, is_divided, tmp_path):
    """Hair of a file saved in Edit Mode is drawn, although the mesh then lists no attributes of corners and
    vertices.
    """
    if is_divided:
        subdivide(ball)
    bpy.ops.vellus.add_hair(guide_count=6, strand_count=20, relax_iterations=2)

    def drawn():
        made = next(c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR")
        return hair_cache.strands_on_gpu(made).points

    before = drawn()
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.mode_set(mode="EDIT")
    path = str(tmp_path / "edited.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    opened = bpy.context.object
    assert opened.mode == "EDIT"
    np.testing.assert_allclose(drawn(), before, atol=1e-6)
    own = scene.read_own_mesh(opened, np.eye(3))
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    out = scene.read_own_mesh(opened, np.eye(3))
    np.testing.assert_array_equal(own.vertices, out.vertices)
    np.testing.assert_array_equal(own.triangles, out.triangles)
    np.testing.assert_allclose(drawn(), before, atol=1e-6)
    uvs = scene.read_surface(opened, bpy.context.evaluated_depsgraph_get()).sized_cage.corner_uvs
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.ops.object.mode_set(mode="OBJECT")
    again = scene.read_surface(bpy.context.object, bpy.context.evaluated_depsgraph_get()).sized_cage.corner_uvs
    np.testing.assert_array_equal(again, uvs)
