# SPDX-License-Identifier: GPL-3.0-or-later
"""Use as Guides refuses ambiguous or unusable input with a message and without changes, and can be undone."""

import bpy
import numpy as np
import pytest

from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, use, world
from tests.support.reading import attribute, snapshot


def test_undo_brings_back_everything(imported, head):
    select(imported)
    bpy.ops.ed.undo_push(message="imported")
    before = snapshot(), stored(imported), world(imported), [*imported.data.attributes.keys()]
    assert use(imported) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="used")
    bpy.ops.ed.undo()
    imported = bpy.data.objects["Imported"]
    assert snapshot() == before[0] and imported.data.vellus.kind == "NONE" and imported.parent is None
    np.testing.assert_array_equal(stored(imported), before[1])
    np.testing.assert_array_equal(world(imported), before[2])
    assert [*imported.data.attributes.keys()] == before[3] and not imported.modifiers


def refused(*chosen, **options):
    """Return the message of a refused click, which must change nothing."""
    before = snapshot(), [(o.name, o.parent, len(o.modifiers)) for o in bpy.data.objects]
    with pytest.raises(RuntimeError) as error:
        use(*chosen, **options)
    assert (snapshot(), [(o.name, o.parent, len(o.modifiers)) for o in bpy.data.objects]) == before
    return str(error.value)


def test_ambiguous_surfaces_are_an_error(imported, head):
    other = bpy.data.objects.new("Other", head.data.copy())
    bpy.context.scene.collection.objects.link(other)
    update()
    assert "Select the mesh" in refused(imported)
    assert "Several meshes" in refused(head, other, imported)
    assert 'no mesh object "Nose"' in refused(imported, surface="Nose")
    assert use(head, imported) == {"FINISHED"} and imported.parent == head


def test_curves_that_are_part_of_something_else_are_refused_with_a_sentence(imported, head):
    twin = bpy.data.objects.new("Twin", imported.data)
    bpy.context.scene.collection.objects.link(twin)
    assert "single-user" in refused(imported)
    bpy.data.objects.remove(twin)
    imported.keyframe_insert("location")
    assert "animated" in refused(imported)
    imported.animation_data_clear()
    head.parent = imported
    assert "parented to its own curves" in refused(imported)
    head.parent = None
    empty = curves_object([np.zeros((2, 3))], "Empty")
    empty.data.remove_curves(indices=[0])
    assert "no curves yet" in refused(empty)
    imported.modifiers.new("Tubes", "NODES").node_group = nodes_without_curves()
    assert "after its modifiers" in refused(imported)
    assert use(imported, applies_modifiers=False) == {"FINISHED"}


def nodes_without_curves():
    nodes = bpy.data.node_groups.new("Tubes", "GeometryNodeTree")
    nodes.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given, made, tubes = (nodes.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeCurveToMesh"))
    nodes.links.new(given.outputs[0], tubes.inputs[0])
    nodes.links.new(tubes.outputs[0], made.inputs[0])
    return nodes


def test_every_nth_is_kept_without_hair_if_wanted(imported):
    use(imported, every=7, grows_hair=False)
    np.testing.assert_array_equal(attribute(imported, "clump"), np.arange(0, 60, 7))
    assert "Hair" not in bpy.data.objects


def test_invalid_curves_are_removed_and_reported(head, rng, capfd):
    lines = list(lines_on(head, rng))
    made = curves_object([*lines, np.zeros((3, 3)), np.full((2, 3), np.nan), lines[0][:1]])
    assert use(made) == {"FINISHED"}
    assert len(made.data.curves) == 60 and np.isfinite(stored(made)).all()
    assert "3 curves with zero length" in capfd.readouterr().out
