# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair stay rooted on a deforming surface, both evaluated by Blender and drawn by Vellus."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, follow_nodes, stored_roots
from hair_addon.blender.live import events, handlers
from hair_addon.core.grooming import following
from tests.support.counting import counts_of
from tests.support.dynamics.following import assert_follows, drawn_points, grow, surface_points, update
from tests.support.reading import evaluated_points, points, vertex_positions, write_points


def test_hair_follows_an_armature_in_every_frame(arm, scene):
    grown = grow(arm)
    at_rest = [evaluated_points(curves_object) for curves_object in grown]
    for frame in (4, 11):
        scene.frame_set(frame)
        assert_follows(*grown)
        assert np.abs(evaluated_points(grown[1]) - at_rest[1]).max() > 0.2
    scene.frame_set(1)
    for curves_object, before in zip(grown, at_rest, strict=True):
        np.testing.assert_allclose(evaluated_points(curves_object), before, atol=1e-6)


def test_strands_between_guides_stay_between(arm, scene):
    """A strand of 98 in 100 lies as close to its guides at rest and bent as the guides' neighbors.

    Guides in the elbow's fold are random, and so are strands beside them.
    """
    guides, hair = grow(arm, guide_count=80, tilt=0.0, gravity=0.0, length_variation=0.0)
    roots = np.linalg.norm(points(hair)[:, None, 0] - points(guides)[None, :, 0], axis=-1)
    near = roots.argsort(axis=1)[:, :3]

    def farthest():
        arms, guide_arms = (np.diff(evaluated_points(o)[:, [0, -1]], axis=1)[:, 0] / 0.3 for o in (hair, guides))
        return np.quantile(np.linalg.norm(arms[:, None] - guide_arms[near], axis=-1).min(axis=1), 0.98)

    at_rest = farthest()
    scene.frame_set(11)
    assert farthest() < 2.0 * at_rest


def test_playing_neither_writes_nor_searches(arm, scene, monkeypatch):
    guides, hair = grow(arm)
    drawn_points(hair)
    calls = counts_of(monkeypatch)
    stored = points(hair), points(guides)
    for frame in range(1, 6):
        scene.frame_set(frame)
        drawn_points(hair)
    assert (calls["searches"], calls["writes"]) == (0, 0)
    assert np.array_equal(points(hair), stored[0]) and np.array_equal(points(guides), stored[1])


def test_hair_grown_in_another_frame_is_the_same_hair(arm, scene):
    _guides, at_rest = grow(arm)
    wanted = points(at_rest)
    scene.frame_set(9)
    _guides, posed = grow(arm)
    np.testing.assert_allclose(points(posed), wanted, atol=1e-6)
    assert_follows(posed)


def key_shape(surface, transform, name="Key"):
    """Add a shape key of value 1 that moves each vertex (N, 3), and return it."""
    if surface.data.shape_keys is None:
        surface.shape_key_add(name="Basis")
    key = surface.shape_key_add(name=name)
    key.data.foreach_set("co", transform(vertex_positions(surface)).astype(np.float32).ravel())
    key.value = 1.0
    update()
    return key


def test_a_rigid_motion_by_a_shape_key_moves_hair_rigidly(sphere):
    guides, hair = grow(sphere)
    turn = np.array(Matrix.Rotation(2.5, 3, (1.0, 2.0, -0.5)))
    key_shape(sphere, lambda v: v @ turn.T + [0.3, 0.0, 1.0])
    for curves_object in (guides, hair):
        wanted = points(curves_object) @ turn.T + [0.3, 0.0, 1.0]
        np.testing.assert_allclose(evaluated_points(curves_object), wanted, atol=1e-5)
        np.testing.assert_allclose(drawn_points(curves_object), wanted, atol=1e-5)


def shear(vertices):
    return vertices + 0.7 * vertices[:, [2, 0, 1]] * [1.0, 0.0, 0.5]


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (2, -0.5, 1)])
def test_hair_follows_a_sheared_surface_under_any_scale(sphere, scale):
    sphere.scale = scale
    update()
    grown = grow(sphere)
    key_shape(sphere, shear)
    assert_follows(*grown)


def test_combing_is_kept_when_the_surface_deforms(sphere):
    guides, hair = grow(sphere)
    combed = points(guides)
    combed[:5, 20:] += np.float32([0.1, 0.2, 0.0])
    write_points(guides, combed)
    key = key_shape(sphere, shear)
    assert np.array_equal(points(guides), combed)
    assert_follows(guides, hair)
    key.value = 0.0
    update()
    np.testing.assert_allclose(evaluated_points(guides), combed, atol=1e-6)


def test_combing_a_deformed_surface_moves_the_hair_that_is_drawn(sphere):
    guides, hair = grow(sphere)
    key_shape(sphere, shear)
    drawn_points(hair)
    combed = points(guides)
    combed[3, 1:] += np.float32([0.1, 0.0, 0.1])
    write_points(guides, combed)
    assert_follows(guides, hair)


def test_nodes_find_roots_on_a_surface_of_other_vertices(sphere):
    """Nodes find roots at the nearest point of the surface at rest if a render subdivides the surface more finely."""
    _guides, hair = grow(sphere)
    key_shape(sphere, shear)
    wanted = evaluated_points(hair)
    follow_nodes.set_surface(hair, sphere, 7, is_combed=False, cage_corners=0)
    hair.data.update_tag()
    update()
    np.testing.assert_allclose(evaluated_points(hair), wanted, atol=1e-5)


def test_hair_is_not_deformed_without_rest_positions(sphere):
    _guides, hair = grow(sphere)
    sphere.add_rest_position_attribute = False
    update()
    np.testing.assert_allclose(evaluated_points(hair), points(hair), atol=1e-6)


def edit(surface, transform):
    """Move a mesh's vertices as Edit Mode does."""
    surface.data.vertices.foreach_set("co", transform(vertex_positions(surface)).astype(np.float32).ravel())
    surface.data.update()
    update()


@pytest.mark.parametrize("is_combed", [False, True])
def test_guides_are_carried_by_edits_of_the_mesh(sphere, is_combed):
    guides, hair = grow(sphere)
    before = points(guides)
    if is_combed:
        before[:5, 20:] += np.float32([0.1, 0.2, 0.0])
        write_points(guides, before)
    hair_before = points(hair)
    turn = np.array(Matrix.Rotation(-1.1, 3, (0.3, 1.0, 0.5)))
    edit(sphere, lambda v: v @ turn.T)
    np.testing.assert_allclose(points(guides), before @ turn.T, atol=1e-5)
    np.testing.assert_allclose(points(hair), hair_before @ turn.T, atol=1e-4)
    assert guides.data.vellus.status == hair.data.vellus.status == ""
    edit(sphere, shear)
    assert_follows(guides, hair)


def test_applying_rotation_and_scale_moves_nothing_in_the_world(sphere):
    sphere.rotation_euler, sphere.scale = (0.3, 0.2, 1.0), (2.0, 2.0, 2.0)
    update()
    guides, hair = grow(sphere)
    combed = points(guides)
    combed[:5, 20:] += np.float32([0.1, 0.2, 0.0])
    write_points(guides, combed)
    sphere.scale = (3.0, 3.0, 3.0)
    update()
    in_world = [in_world_axes(curves_object) for curves_object in (guides, hair)]
    for selected in bpy.context.selected_objects:
        selected.select_set(False)
    bpy.context.view_layer.objects.active = sphere
    sphere.select_set(True)
    bpy.ops.object.transform_apply(location=False, rotation=True, scale=True)
    update()
    assert np.array(sphere.matrix_world).trace() == 4.0
    for curves_object, wanted in zip((guides, hair), in_world, strict=True):
        np.testing.assert_allclose(in_world_axes(curves_object), wanted, atol=1e-4)


def in_world_axes(curves_object):
    return points(curves_object) @ np.array(curves_object.matrix_world.to_3x3()).T


def test_an_edited_vertex_moves_only_the_hair_around_it(sphere):
    _guides, hair = grow(sphere)
    before = points(hair)
    place = vertex_positions(sphere)[0]

    def pull(vertices):
        vertices[0] *= 1.05
        return vertices

    edit(sphere, pull)
    far = np.linalg.norm(before[:, 0] - place, axis=1) > 1.5
    assert far.any()
    np.testing.assert_allclose(points(hair)[far], before[far], atol=1e-6)  # guides are carried to rounding


def test_other_faces_root_guides_again_and_say_so(sphere):
    guides, hair = grow(sphere)
    combed = points(guides)
    combed[:5, 20:] += np.float32([0.1, 0.2, 0.0])
    write_points(guides, combed)
    sphere.modifiers.new("Coarser", "DECIMATE").ratio = 0.5
    update()
    assert "Faces" in guides.data.vellus.status
    np.testing.assert_allclose(points(guides), combed, atol=1e-6)
    assert len(hair.data.curves) == 200 and np.isfinite(points(hair)).all()
    for curves_object in (guides, hair):
        np.testing.assert_allclose(evaluated_points(curves_object)[:, 0], surface_points(curves_object), atol=0.02)


def test_moving_the_object_computes_and_uploads_nothing(sphere, monkeypatch):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    sphere.parent = parent
    guides, hair = grow(sphere)
    drawn_points(hair), drawn_points(guides)
    calls = counts_of(monkeypatch)
    monkeypatch.setattr(following, "weights_now", None)  # whoever calls it fails
    for step in range(3):
        parent.location.x = step
        sphere.rotation_euler.z = 0.1 * step
        update()
        drawn_points(hair), drawn_points(guides)
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}


def test_two_grooms_on_one_mesh_and_one_mesh_on_two_objects(sphere):
    twin = bpy.data.objects.new("Twin", sphere.data)
    bpy.context.scene.collection.objects.link(twin)
    twin.location.x = 3.0
    update()
    first, second, other = grow(sphere), grow(sphere, guide_count=25), grow(twin)
    assert [pair[0].data.surface for pair in (first, second, other)] == [sphere, sphere, twin]
    edit(sphere, shear)
    assert_follows(*first, *second, *other)
    combed = points(first[0])
    combed[:, 30:] += 0.1
    untouched = points(second[1]), points(other[1])
    write_points(first[0], combed)
    assert np.array_equal(points(second[1]), untouched[0]) and np.array_equal(points(other[1]), untouched[1])


def test_undo_while_deformed_leaves_hair_on_the_surface(arm, scene):
    guides, hair = grow(arm)
    bpy.ops.ed.undo_push(message="grown")
    scene.frame_set(7)
    combed = points(guides)
    combed[:10, 5:] += 0.1
    write_points(guides, combed)
    bpy.ops.ed.undo_push(message="combed")
    after = points(hair)
    bpy.ops.ed.undo()
    update()
    guides, hair = bpy.data.objects["Guides"], bpy.data.objects["Hair"]
    assert not np.array_equal(points(hair), after)
    assert_follows(guides, hair)
    bpy.ops.ed.redo()
    update()
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), after, atol=1e-6)


def test_guides_that_were_told_other_roots_are_carried_from_there(sphere):
    guides, _hair = grow(sphere)
    key_shape(sphere, lambda vertices: vertices * np.float32([1.0, 2.0, 0.5]))
    drawn_points(guides)
    surface = scene.read_surface(sphere, bpy.context.evaluated_depsgraph_get())
    roots = stored_roots.points(guides.data, surface)
    curves.write_roots(guides.data, surface, roots[::-1])
    update()
    drawn = drawn_points(guides)
    events.strands_computed(guides.data)
    np.testing.assert_array_equal(drawn, drawn_points(guides))


def content(group):
    """Return a node group's sockets, nodes with settings and values, and links, as plain values."""
    ignored = {"bl_rna", "rna_type", "inputs", "outputs", "internal_links", "panel_states", "dimensions"}

    def plain(value):
        if isinstance(value, bpy.types.bpy_prop_collection):
            return [(item.name, getattr(item, "data_type", None)) for item in value]
        if isinstance(value, bpy.types.bpy_struct):
            return type(value).__name__
        return value if isinstance(value, (str, int, float, bool, type(None))) else tuple(value)

    def settings(struct):
        names = {name for name in struct.bl_rna.properties.keys() if name not in ignored}
        return {name: plain(getattr(struct, name)) for name in sorted(names)}

    numbers = {node.name: number for number, node in enumerate(group.nodes)}
    return (
        [(item.identifier, item.name, item.socket_type, item.in_out) for item in group.interface.items_tree],
        [settings(node) for node in group.nodes],
        [[plain(getattr(s, "default_value", None)) for s in node.inputs] for node in group.nodes],
        {
            (
                numbers[one.from_node.name],
                one.from_socket.identifier,
                numbers[one.to_node.name],
                one.to_socket.identifier,
            )
            for one in group.links
        },
        (dict(group), group.is_modifier, group.interface.items_tree["Hidden"].hide_in_modifier),
    )


def test_the_file_holds_the_nodes_that_the_code_builds(scene):
    """The stored nodes are those that the code builds; if not, run `python tools/write_nodes.py`."""
    read, built = content(follow_nodes._appended()), content(follow_nodes.build())
    for part, expected in zip(read, built, strict=True):
        assert part == expected


def test_reading_the_nodes_leaves_no_library_and_no_user(scene):
    known = set(bpy.data.libraries)
    group = follow_nodes._appended()
    assert set(bpy.data.libraries) == known and group.library is None
    assert (group.users, group.use_fake_user) == (0, False)


@pytest.mark.parametrize("content", [None, b"", b"BLENDER-v502 and no more"])
def test_nodes_are_built_where_their_file_cannot_be_read(scene, monkeypatch, tmp_path, content):
    path = tmp_path / "nodes.blend"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(follow_nodes, "_FILE", path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert follow_nodes._carries(follow_nodes._group())


def test_reading_the_nodes_is_no_import_of_hair(hair, monkeypatch, tmp_path):
    """Changes from before hair is made are still followed; appended hair is shown and has readable names."""
    imports = []
    monkeypatch.setattr(handlers, "_show_hidden", lambda: imports.append("hair"))
    path = str(tmp_path / "hair.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    imports.clear()  # saving shows all hair, too
    follow_nodes._appended()
    assert imports == []
    with bpy.data.libraries.load(path) as (_there, here):
        here.objects = ["Hair"]
    assert imports == ["hair"]
