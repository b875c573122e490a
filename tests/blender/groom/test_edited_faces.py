# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a surface with changed faces keeps its place if its own face still exists."""

import re
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import stored_roots
from tests.support.interface.layout import draw
from tests.support.reading import attribute, evaluated_points, points, write_points

GRID = 8  # faces along a side, 1 m wide


@pytest.fixture
def hair(scene):
    """Return the object of 400 strands between combed guides on a bumpy grid with a weight group and an eye beside
    it.
    """
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=GRID, y_subdivisions=GRID, size=1.0)
    grid = bpy.context.object
    grid.name = "Skin"
    for vertex in grid.data.vertices:
        vertex.co.z = 0.1 * np.sin(7.0 * vertex.co.x) * np.cos(5.0 * vertex.co.y)
    group = grid.vertex_groups.new(name="Scalp")
    group.add([vertex.index for vertex in grid.data.vertices], 1.0, "REPLACE")
    bpy.ops.vellus.add_hair(guide_count=40, strand_count=400, length=0.2, density_group="Scalp")
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    bent = points(guides)
    bent[:, :, 0] += np.linspace(0.0, 0.3, bent.shape[1]) ** 2
    write_points(guides, bent)
    return hair


@contextmanager
def edit_mode():
    skin = bpy.data.objects["Skin"]
    bpy.context.view_layer.objects.active = skin
    bpy.ops.object.mode_set(mode="EDIT")
    yield
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()


def select(*faces):
    """Select the given faces of the skin, in Object Mode."""
    skin = bpy.data.objects["Skin"].data
    skin.polygons.foreach_set("select", np.isin(np.arange(len(skin.polygons)), faces))
    skin.edges.foreach_set("select", np.zeros(len(skin.edges), bool))
    skin.vertices.foreach_set("select", np.zeros(len(skin.vertices), bool))
    bpy.context.tool_settings.mesh_select_mode = (False, False, True)
    chosen = [edge for face in faces for edge in skin.polygons[face].vertices]
    for vertex in chosen:
        skin.vertices[vertex].select = True


def faces_of(curves_object, count):
    """Return (S,) bool: whether strands are rooted on one of the first faces."""
    return attribute(curves_object, "root_triangle") // 2 < count


def roots_apart(curves_object):
    """Return the largest distance of a stored root from the first point of its strand."""
    skin = bpy.data.objects["Skin"].data
    vertices, weights = stored_roots.places(curves_object.data, len(skin.vertices))
    places = np.array([vertex.co for vertex in skin.vertices])
    assert weights.any(axis=1).all()
    there = (weights[..., None] * places[vertices]).sum(axis=1)
    return np.linalg.norm(there - points(curves_object)[:, 0], axis=1).max()


def join():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.1, location=(0.0, 0.0, -1.0))
    eye, skin = bpy.context.object, bpy.data.objects["Skin"]
    skin.select_set(True)
    eye.select_set(True)
    bpy.context.view_layer.objects.active = skin
    bpy.ops.object.join()


def extrude():
    select(0, 1)
    with edit_mode():
        bpy.ops.mesh.extrude_region_move(TRANSFORM_OT_translate={"value": (0.0, 0.0, 0.2)})


def separate():
    select(0, 1)
    with edit_mode():
        bpy.ops.mesh.separate(type="SELECTED")


def delete():
    select(0, 1)
    with edit_mode():
        bpy.ops.mesh.delete(type="FACE")


def cut():
    select(0, 1)
    with edit_mode():
        bpy.ops.mesh.subdivide(number_cuts=1)


EDITS = {edit.__name__: edit for edit in (join, extrude, separate, delete, cut)}


@pytest.mark.parametrize("name", EDITS)
def test_strands_stay_whose_face_is_left_alone(hair, name):
    guides, before = bpy.data.objects["Hair Guides"], points(hair)
    guides_before, lost = points(guides), faces_of(hair, 2)
    counts = faces_of(guides, 2).sum(), lost.sum()
    kept = np.ones(len(before), bool) if name == "join" else ~lost
    EDITS[name]()
    bpy.context.view_layer.update()
    assert len(bpy.data.objects["Skin"].data.polygons) != GRID**2 or name == "extrude"
    np.testing.assert_array_equal(points(guides), guides_before)
    # Faces beside those that are cut get other corners, and with these another shape.
    np.testing.assert_allclose(points(hair)[kept, 0], before[kept, 0], rtol=0.0, atol=0.02 if name == "cut" else 1e-6)
    # Normals of vertices beside the faces have changed, and guides nearby turn strands by them.
    is_far = before[:, 0, 1] > 0.0
    np.testing.assert_allclose(points(hair)[is_far], before[is_far], rtol=0.0, atol=1e-3)
    assert roots_apart(hair) < 1e-6
    np.testing.assert_allclose(evaluated_points(hair), points(hair), rtol=0.0, atol=1e-6)
    reported = [int(number) for number in re.findall(r"\d+", guides.data.vellus.status)]
    if name == "join":
        assert guides.data.vellus.status == ""
    else:
        # A cut face is made of others, which hold a part of its corners: some roots find theirs.
        assert 0 < reported[1] <= counts[1] and reported[0] <= counts[0]
        assert "moved to the nearest points." in guides.data.vellus.status
    assert hair.data.vellus.status == ""


def test_strands_are_carried_with_what_is_moved_while_faces_come_and_go(hair):
    """Strands follow their faces when faces are deleted and others moved in a single visit to Edit Mode."""
    before, moved = points(hair), slice(20, 60)
    lost = faces_of(hair, 1)
    corners = np.array([attribute(hair, name) for name in stored_roots.VERTICES])
    is_moved = ((corners >= 20) & (corners < 60)).all(axis=0)
    is_still = ((corners < 20) | (corners >= 60)).all(axis=0)
    select(0)
    with edit_mode():
        bpy.ops.mesh.extrude_region_move()
        bpy.ops.mesh.delete(type="FACE")
        edited = bmesh.from_edit_mesh(bpy.data.objects["Skin"].data)
        edited.verts.ensure_lookup_table()
        for vertex in edited.verts[moved]:
            vertex.co.z += 0.5
    raised = before + np.array((0.0, 0.0, 0.5), np.float32)
    assert is_moved.sum() > 50 and is_still.sum() > 50
    np.testing.assert_allclose(points(hair)[is_moved, 0], raised[is_moved, 0], atol=1e-6)
    np.testing.assert_allclose(points(hair)[is_still & ~lost, 0], before[is_still & ~lost, 0], atol=1e-6)


def test_a_remeshed_surface_has_its_strands_at_the_nearest_points(hair):
    skin = bpy.data.objects["Skin"]
    skin.data.remesh_voxel_size = 0.02
    modifier = skin.modifiers.new("Solid", "SOLIDIFY")
    modifier.thickness = 0.05
    bpy.context.view_layer.objects.active = skin
    bpy.ops.object.modifier_apply(modifier="Solid")
    bpy.context.view_layer.update()
    before = points(hair)  # spread over both sides
    bpy.ops.object.voxel_remesh()
    bpy.context.view_layer.update()
    assert np.linalg.norm(points(hair)[:, 0] - before[:, 0], axis=1).max() < 0.04
    assert "400 strands" in bpy.data.objects["Hair Guides"].data.vellus.status


def test_a_remesh_that_makes_two_walls_of_an_open_surface_is_explained(hair):
    """A second remesh, of the closed surface, is reported like any edit."""
    skin = bpy.data.objects["Skin"]
    state = bpy.data.objects["Hair Guides"].data.vellus
    assert state.is_on_open
    skin.data.remesh_voxel_size = 0.05
    bpy.context.view_layer.objects.active = skin
    bpy.ops.object.voxel_remesh()
    bpy.context.view_layer.update()
    state = bpy.data.objects["Hair Guides"].data.vellus
    assert state.status.startswith('The holes of "Skin" were closed') and not state.is_on_open
    skin.data.remesh_voxel_size = 0.04
    bpy.ops.object.voxel_remesh()
    bpy.context.view_layer.update()
    assert "400 strands" in bpy.data.objects["Hair Guides"].data.vellus.status


def test_a_mask_that_is_painted_in_the_same_edit_places_strands_again(hair):
    skin = bpy.data.objects["Skin"]
    half = [vertex.index for vertex in skin.data.vertices if vertex.co.x < -0.05]
    skin.vertex_groups["Scalp"].add(half, 0.0, "REPLACE")
    join()
    bpy.context.view_layer.update()
    assert points(hair)[:, 0, 0].min() > -0.2


def test_a_quad_that_is_cut_otherwise_keeps_its_strands(scene):
    """Strands of a quad keep their places when it becomes concave and Blender divides it along its other diagonal."""
    mesh = bpy.data.meshes.new("Skin")
    places = [(x, y, 0.0) for y in range(3) for x in range(3)]
    mesh.from_pydata(places, [], [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)])
    skin = bpy.data.objects.new("Skin", mesh)
    bpy.context.collection.objects.link(skin)
    bpy.context.view_layer.objects.active = skin
    bpy.ops.vellus.add_hair(guide_count=40, strand_count=300, length=0.2)
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    before, combed = points(hair)[:, 0], points(guides)[:, 0]
    mesh.vertices[1].co = (0.3, 0.6, 0.0)
    mesh.calc_loop_triangles()
    assert {*mesh.loop_triangles[0].vertices} == {0, 1, 3}
    mesh.update_tag()
    bpy.context.view_layer.update()
    for strands, roots in ((guides, combed), (hair, before)):
        far, is_first = roots[:, 1] > 1.0, faces_of(strands, 1)
        np.testing.assert_allclose(points(strands)[far, 0], roots[far], atol=1e-6)
        assert roots_apart(strands) < 1e-6
        x, y, _z = points(strands)[is_first, 0].T
        assert is_first.sum() > 5
        assert (y >= np.where(x < 0.3, 2.0 * x, 0.6 + (x - 0.3) / 1.75) - 1e-6).all()  # in what is left of the quad
    assert guides.data.vellus.status == ""


def test_strands_that_were_edited_by_hand_are_carried_too(hair):
    """Strands edited by hand move with the surface when an edit moves vertices or adds faces, and are not
    regenerated.
    """
    edited = points(hair)
    edited[:, :, 1] += np.linspace(0.0, 0.2, edited.shape[1]) ** 2
    write_points(hair, edited)
    skin = bpy.data.objects["Skin"]
    for vertex in skin.data.vertices:
        vertex.co = (vertex.co.x, -vertex.co.z, vertex.co.y + 0.5)
    skin.data.update_tag()
    bpy.context.view_layer.update()
    turned = np.stack([edited[..., 0], -edited[..., 2], edited[..., 1] + np.float32(0.5)], axis=-1)
    np.testing.assert_allclose(points(hair), turned, atol=2e-5)
    select(0)
    with edit_mode():
        bpy.ops.mesh.extrude_region_move()
        moved = bmesh.from_edit_mesh(skin.data)
        moved.verts.ensure_lookup_table()
        for vertex in moved.verts[20:60]:
            vertex.co.x += 0.25
    corners = np.array([attribute(hair, name) for name in stored_roots.VERTICES])
    is_moved = ((corners >= 30) & (corners < 50)).all(axis=0)  # with all of their faces
    assert is_moved.sum() > 20
    np.testing.assert_allclose(points(hair)[is_moved, 0], turned[is_moved, 0] + (0.25, 0.0, 0.0), atol=2e-5)


@pytest.fixture
def changing(hair, scene):
    """Return hair on a skin that a keyed modifier strips of most faces until frame 10, with an undo step in frame 1."""
    decimate = bpy.data.objects["Skin"].modifiers.new("Decimate", "DECIMATE")
    for frame, ratio in ((1, 1.0), (10, 0.2)):
        decimate.ratio = ratio
        decimate.keyframe_insert("ratio", frame=frame)
    scene.frame_set(1)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="made")
    return hair


def step(name):
    """Undo or redo, and evaluate the scene."""
    getattr(bpy.ops.ed, name)()
    bpy.context.view_layer.update()


def test_undo_across_frames_of_changing_faces_roots_nothing_again(changing, scene):
    """Undo across frames with different faces keeps all roots, as a change by the frame is no edit."""
    before = {name: points(bpy.data.objects[name]) for name in ("Hair", "Hair Guides")}
    topology = bpy.data.objects["Hair"].data.vellus.topology
    scene.frame_set(5)
    bpy.ops.ed.undo_push(message="another frame")
    panel = " ".join(draw(bpy.types.VELLUS_PT_surface).texts)
    assert '"Skin" has other faces in this frame: hair stays on the faces of the frame' in panel
    for name in ("undo", "redo", "undo", "redo"):
        step(name)
    assert bpy.context.scene.frame_current == 5
    bpy.data.objects["Skin"].data.update_tag()
    bpy.context.view_layer.update()
    for name, expected in before.items():
        assert bpy.data.objects[name].data.vellus.status == ""
        np.testing.assert_array_equal(points(bpy.data.objects[name]), expected)
    bpy.context.scene.frame_set(1)
    assert bpy.data.objects["Hair"].data.vellus.topology == topology
    assert "other faces" not in " ".join(draw(bpy.types.VELLUS_PT_surface).texts)


def test_an_edit_in_such_a_frame_is_followed(changing, scene):
    scene.frame_set(5)
    bpy.context.view_layer.objects.active = bpy.data.objects["Skin"]
    select(0, 1, 2)
    with edit_mode():
        bpy.ops.mesh.delete(type="FACE")
    assert "were deleted" in bpy.data.objects["Hair Guides"].data.vellus.status


def test_a_setting_that_is_changed_back_is_an_edit_too(hair, scene):
    """A ratio that is changed and changed back within a frame counts as two edits of the topology."""
    decimate = bpy.data.objects["Skin"].modifiers.new("Decimate", "DECIMATE")
    topologies = []
    for frame, ratio in ((1, 0.5), (2, 0.5), (2, 1.0), (2, 0.5)):
        scene.frame_set(frame)
        decimate.ratio = ratio
        bpy.context.view_layer.update()
        topologies.append(bpy.data.objects["Hair"].data.vellus.topology)
    assert topologies[0] == topologies[1] == topologies[3] != topologies[2]
