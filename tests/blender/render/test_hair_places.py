# SPDX-License-Identifier: GPL-3.0-or-later
"""Instanced hair is drawn at every instance of its collection or object, and uploaded once."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.live import invalidation
from hair_addon.blender.render import drawn_scene, hair_cache, hair_places
from tests.support.counting import counts_of
from tests.support.pictures.viewports import view3d
from tests.support.reading import points


def read(space=None, **details):
    bpy.context.view_layer.update()
    context = bpy.context
    return drawn_scene.read(
        context.scene, context.view_layer, context.evaluated_depsgraph_get(), space, hair_cache.refuse, **details
    )


def instancer(name, collection, location=(0.0, 0.0, 0.0), into=None):
    """Return an empty that instances a collection."""
    empty = bpy.data.objects.new(name, None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", collection, location
    (into or bpy.context.scene.collection).objects.link(empty)
    return empty


@pytest.fixture
def creature(hair):
    """Return the collection of the hairy sphere, which the scene itself does not show."""
    collection = bpy.data.collections.new("Creature")
    for part in list(bpy.data.objects):
        collection.objects.link(part)
        bpy.context.scene.collection.objects.unlink(part)
    return collection


def places(drawn):
    """Return where each hair is drawn, from left to right."""
    return sorted(tuple(np.round(to_world[:3, 3], 4)) for _strands, _shading, to_world, *_ in drawn.hair)


def test_each_instance_is_drawn_in_its_place_and_uploaded_once(creature, monkeypatch):
    one, two = instancer("One", creature, (3.0, 0.0, 0.0)), instancer("Two", creature, (6.0, 0.0, 1.0))
    invalidation.clear()
    counts = counts_of(monkeypatch)
    drawn = read(view3d())
    assert places(drawn) == [(3.0, 0.0, 0.0), (6.0, 0.0, 1.0)]
    assert counts["uploads"] == 1
    assert sorted(drawn.owners) == sorted((one.session_uid, two.session_uid))
    assert len(drawn.surfaces) == 2


def test_the_instanced_hair_itself_is_drawn_too_where_it_is(hair):
    collection = bpy.data.collections.new("Creature")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(hair)
    instancer("One", collection, (3.0, 0.0, 0.0))
    drawn = read(view3d())
    assert places(drawn) == [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]
    assert hair.session_uid in drawn.owners


def test_instances_in_instances_are_turned_with_them(creature):
    pair = bpy.data.collections.new("Pair")
    instancer("Left", creature, (-1.0, 0.0, 0.0), pair), instancer("Right", creature, (1.0, 0.0, 0.0), pair)
    outer = instancer("Outer", pair, (0.0, 0.0, 5.0))
    outer.rotation_euler = (0.0, 0.0, np.pi / 2)
    drawn = read(view3d())
    assert places(drawn) == [(0.0, -1.0, 5.0), (0.0, 1.0, 5.0)]
    assert set(drawn.owners) == {outer.session_uid}


def test_instances_of_geometry_nodes_are_drawn(creature):
    tree = bpy.data.node_groups.new("Put", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info, move = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeTransform")
    info.inputs["Object"].default_value = bpy.data.objects["Hair"]
    info.inputs["As Instance"].default_value = True
    move.inputs["Translation"].default_value = (0.0, 4.0, 0.0)
    tree.links.new(info.outputs["Geometry"], move.inputs["Geometry"])
    tree.links.new(move.outputs["Geometry"], tree.nodes.new("NodeGroupOutput").inputs[0])
    carrier = bpy.data.objects.new("Carrier", bpy.data.meshes.new("Carrier"))
    bpy.context.scene.collection.objects.link(carrier)
    carrier.modifiers.new("Put", "NODES").node_group = tree
    drawn = read(view3d())
    assert places(drawn) == [(0.0, 4.0, 0.0)]
    assert drawn.owners == (carrier.session_uid,)
    # Strands that become geometry of the mesh are no hair of ours any more.
    info.inputs["As Instance"].default_value = False
    assert read(view3d()).hair == []


def look_at_nothing_but_a_cube(space):
    """Enter a stand-in for local view of a cube, as local view has no property to set."""
    bpy.ops.mesh.primitive_cube_add()
    screen, area = next((s, a) for s in bpy.data.screens for a in s.areas if a.spaces.active == space)
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(screen=screen, area=area, region=region):
        bpy.ops.view3d.localview()


HIDDEN = {
    "something else is in local view": look_at_nothing_but_a_cube,
    "the instancer is hidden": lambda space: bpy.data.objects["One"].hide_set(True),
    "the instancer is switched off": lambda space: setattr(bpy.data.objects["One"], "hide_viewport", True),
    "the hair is switched off": lambda space: setattr(bpy.data.objects["Hair"], "hide_viewport", True),
    "the viewport leaves hair out": lambda space: setattr(space, "show_object_viewport_curves", False),
    "Blender draws the hair": lambda space: setattr(bpy.data.objects["Hair"].data.vellus, "is_drawn", False),
}


@pytest.mark.parametrize("case", HIDDEN)
def test_hidden_instances_are_left_out(creature, case):
    instancer("One", creature)
    space = view3d()
    assert len(read(space).hair) == 1
    try:
        HIDDEN[case](space)
        assert read(space).hair == []
    finally:
        space.show_object_viewport_curves = True


def test_renders_leave_out_instances_of_an_instancer_that_they_do_not_show(creature):
    one = instancer("One", creature, (3.0, 0.0, 0.0))
    shown = [(len(drawn.hair), len(drawn.surfaces)) for drawn in (read(None), read(view3d()))]
    assert shown == [(1, 1), (1, 1)]
    one.hide_render = True
    shown = [(len(drawn.hair), len(drawn.surfaces)) for drawn in (read(None), read(view3d()))]
    assert shown == [(0, 0), (1, 1)]


@pytest.mark.parametrize("is_instanced", [False, True])
def test_renders_leave_out_hair_whose_camera_is_off_and_viewports_show_it(hair, is_instanced):
    """A render leaves out hair whose camera icon is off in the list of systems, and viewports show it."""
    if is_instanced:
        collection = bpy.data.collections.new("Creature")
        collection.objects.link(hair)
        instancer("One", collection, (3.0, 0.0, 0.0))
    count = 1 + is_instanced
    assert [len(read(space).hair) for space in (None, view3d())] == [count, count]
    hair.hide_render = True
    assert [len(read(space).hair) for space in (None, view3d())] == [0, count]


def test_an_instance_is_selected_with_its_instancer(creature):
    one, _two = instancer("One", creature), instancer("Two", creature, (5.0, 0.0, 0.0))
    one.select_set(True)
    drawn = read(view3d())
    assert dict(zip(drawn.owners, drawn.selected, strict=True))[one.session_uid]
    assert sum(drawn.selected) == 1


def test_combing_moves_the_strands_of_instances_and_walks_no_instances(creature, monkeypatch):
    instancer("One", creature, (3.0, 0.0, 0.0))
    before = read(view3d())
    monkeypatch.setattr(hair_places, "read_instances", lambda *_: pytest.fail("walked"))
    draft = read(view3d(), before=before, is_draft=True)
    assert places(draft) == places(before)


def test_a_file_without_hair_walks_no_instances(sphere):
    class Depsgraph:
        @property
        def object_instances(self):
            pytest.fail("walked")

    assert hair_places.read_instances(Depsgraph(), None) == ()


def test_an_instancer_that_was_deleted_since_is_no_danger(creature):
    one = instancer("One", creature)
    before = read(view3d())
    bpy.data.objects.remove(one)
    assert read(view3d(), before=before).hair == []


def camera_in_front(distance):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -distance, 0.0), (np.pi / 2, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (np.pi / 3, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(sun)


def test_an_instance_is_the_same_picture_as_the_hair_itself(hair):
    """An instance gives the same picture as the hair itself, except for rounding in the choice of the nearest
    strand.
    """
    camera_in_front(8.0)
    picture = {"itself": api.draw(width=96, height=96, is_transparent=True)}
    collection = bpy.data.collections.new("Creature")
    for name in ("Sphere", "Hair"):
        collection.objects.link(bpy.data.objects[name])
        bpy.context.scene.collection.objects.unlink(bpy.data.objects[name])
    instancer("One", collection)
    picture["instance"] = api.draw(width=96, height=96, is_transparent=True)
    assert picture["itself"][..., 3].sum() > 500
    np.testing.assert_allclose(picture["instance"], picture["itself"], atol=1e-3)


def test_hair_of_a_linked_collection_is_drawn(creature, tmp_path):
    expected = points(bpy.data.objects["Hair"])
    instancer("One", creature)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "creature.blend"), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "creature.blend"), link=True) as (_source, target):
        target.collections = ["Creature"]
    instancer("Linked", target.collections[0], (2.0, 0.0, 0.0))
    drawn = read(view3d())
    assert places(drawn) == [(2.0, 0.0, 0.0)]
    strands = drawn.hair[0][0]
    assert (strands.strand_count, strands.point_count) == expected.shape[:2]
    np.testing.assert_allclose(strands.box.exact[1] - strands.box.exact[0], np.ptp(expected, axis=(0, 1)), atol=1e-4)
