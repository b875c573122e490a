# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide weights are stored with hair while nodes read them, and not otherwise."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import guide_map_readers
from hair_addon.blender.groom import bindings
from hair_addon.core.grooming import following
from tests.support.dynamics.following import update
from tests.support.reading import guide_map, points, write_points

pytestmark = pytest.mark.usefixtures("made_anew")


def named_attribute(tree, name):
    """Return a node that reads an attribute into a value that moves points, so that the tree is evaluated."""
    read, moved = tree.nodes.new("GeometryNodeInputNamedAttribute"), tree.nodes.new("GeometryNodeSetPosition")
    read.data_type = "FLOAT"
    read.inputs["Name"].default_value = name
    tree.links.new(tree.nodes["In"].outputs[0], moved.inputs["Geometry"])
    tree.links.new(read.outputs["Attribute"], moved.inputs["Offset"])
    tree.links.new(moved.outputs["Geometry"], tree.nodes["Out"].inputs[0])
    return read


@pytest.fixture
def modified(hair):
    """Return (hair object, the empty node group of a modifier on it); no node reads guide weights."""
    tree = bpy.data.node_groups.new("Reader", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    tree.nodes.new("NodeGroupInput").name, tree.nodes.new("NodeGroupOutput").name = "In", "Out"
    tree.links.new(tree.nodes["In"].outputs[0], tree.nodes["Out"].inputs[0])
    hair.modifiers.new("Reader", "NODES").node_group = tree
    update()
    assert guide_map(hair.data) is None
    return hair, tree


def comb(guides):
    combed = points(guides).copy()
    combed[::2, 1:, 0] += np.linspace(0.0, 0.2, combed.shape[1] - 1)
    write_points(guides, combed)
    update()


def assert_stored(hair):
    """Assert that hair stores the weights by which its strands follow guides now."""
    bound, found = bindings.of(hair), guide_map(hair)
    expected = following.weights_now(bound.binding, bound.guides).weights.numpy()
    np.testing.assert_array_equal(found[1], expected)


def test_weights_are_stored_when_a_node_begins_to_read_them_and_kept_up_to_date(modified):
    hair, tree = modified
    comb(bpy.data.objects["Guides"])
    assert guide_map(hair.data) is None
    node = named_attribute(tree, "guide_weight_0")
    update()
    assert_stored(hair.data)
    before = guide_map(hair.data)[1]
    moved = np.empty(len(hair.data.points) * 3, np.float32)
    shown = hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    shown.attributes["position"].data.foreach_get("vector", moved)
    np.testing.assert_allclose(  # the node has read them
        (moved.reshape(len(before), -1, 3) - points(hair))[:, -1], before[:, :1].repeat(3, axis=1), atol=1e-4
    )
    comb(bpy.data.objects["Guides"])
    assert_stored(hair.data)
    assert not np.array_equal(guide_map(hair.data)[1], before)
    tree.nodes.remove(node)
    update()
    comb(bpy.data.objects["Guides"])
    assert guide_map(hair.data) is None


def test_a_modifiers_input_reads_them(modified):
    hair, tree = modified
    socket = tree.interface.new_socket("Weight", in_out="INPUT", socket_type="NodeSocketString")
    update()
    assert guide_map(hair.data) is None
    getattr(hair.modifiers["Reader"].properties.inputs, socket.identifier).value = "guide_weight_0"
    hair.update_tag()
    update()
    assert_stored(hair.data)


def test_a_material_reads_them(hair):
    material = bpy.data.materials.new("Weights")
    hair.data.materials.append(material)
    update()
    assert guide_map(hair.data) is None
    material.node_tree.nodes.new("ShaderNodeAttribute").attribute_name = "guide_weight_1"
    update()
    assert_stored(hair.data)


def test_nodes_of_a_file_that_was_opened_find_them(modified, tmp_path):
    """Nodes of a file that was just opened find guide weights, although its hair is neither bound nor changed."""
    hair, _tree = modified
    expected = [array.copy() for array in bindings.of(hair.data).guide_map]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "groom.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "groom.blend"))
    hair = bpy.data.objects["Hair"]
    before = points(hair)
    named_attribute(bpy.data.node_groups["Reader"], "guide_index_0")
    update()
    for array, there in zip(guide_map(hair.data), expected, strict=True):
        np.testing.assert_array_equal(array, there)
    np.testing.assert_array_equal(points(hair), before)


def test_new_hair_has_them_where_nodes_read_them(modified):
    _hair, tree = modified
    named_attribute(tree, "guide_weight_")  # the slot's number is joined to it
    made = api.interpolate_hair(bpy.data.objects["Guides"], strand_count=100)
    assert guide_map(made.data if hasattr(made, "data") else made) is not None


def test_nodes_are_not_looked_through_when_objects_move(modified, monkeypatch):
    hair, tree = modified
    looks, real = [], guide_map_readers._reading_of
    monkeypatch.setattr(guide_map_readers, "_reading_of", lambda tree: looks.append(1) or real(tree))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    update()
    looks.clear()
    for x in range(3):
        lamp.location.x = x
        update()
    assert not looks
    named_attribute(tree, "guide_weight_0")
    update()
    assert looks
    assert_stored(hair.data)
