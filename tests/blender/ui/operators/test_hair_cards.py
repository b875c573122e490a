# SPDX-License-Identifier: GPL-3.0-or-later
"""The dialogs of cards and tubes show the numbers of polygons that are created."""

import bpy
import pytest

from hair_addon.blender.host import running
from hair_addon.blender.ui.operators.base.dialog import DialogOperator
from hair_addon.blender.ui.operators.base.modal import LongOperator
from tests.support.interface.layout import redo_panel


def test_polygons_are_named_before_they_are_made(hair):
    values = {"card_count": 40, "segment_count": 3, "level_count": 2, "texture_size": 256}
    texts = redo_panel("hair_cards", **values).texts
    assert "Level 0: 40 cards, 240 triangles, 256 px" in texts
    assert "Level 1: 20 cards, 40 triangles, 128 px" in texts
    bpy.ops.vellus.hair_cards(**values)
    meshes = [bpy.data.meshes[f"Hair Cards LOD{level}"] for level in (0, 1)]
    assert [2 * len(mesh.polygons) for mesh in meshes] == [240, 40]
    bpy.ops.vellus.hair_tubes(side_count=4, point_count=5, tube_count=0)
    mesh = bpy.data.meshes["Hair Tubes"]
    mesh.calc_loop_triangles()
    assert (
        f"500 tubes, {len(mesh.loop_triangles):,} triangles"
        in redo_panel("hair_tubes", side_count=4, point_count=5, tube_count=0).texts
    )


class Asked(DialogOperator):
    """A mock of a registered operator, which only Blender can create."""

    bl_idname = "VELLUS_OT_hair_tubes"  # as Blender names operators that are running

    def as_keywords(self):
        return {"tube_count": 3}


@pytest.mark.parametrize("is_asking", [True, False])
def test_it_asks_unless_it_is_given_a_setting(hair, window, monkeypatch, is_asking):
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(LongOperator, "invoke", lambda self, context, event: {"FINISHED"})
    window.window_manager.invoke_props_dialog = lambda operator, width: {"RUNNING_MODAL"}
    operator = Asked()
    operator.properties = bpy.context.window_manager.operator_properties_last("vellus.hair_tubes")
    operator.properties.property_unset("tube_count")
    if not is_asking:
        operator.properties.tube_count = 3
    assert operator.invoke(window, None) == ({"RUNNING_MODAL"} if is_asking else {"FINISHED"})


@pytest.mark.parametrize("is_asking", [True, False])
def test_what_was_asked_for_is_made_once(hair, monkeypatch, is_asking):
    """The dialog runs an undoable operator once, and a repetition by the redo panel runs the same operator."""
    at_once = []
    monkeypatch.setattr(LongOperator, "execute", lambda self, context: at_once.append(self) or {"FINISHED"})
    operator = Asked()
    operator._is_asking = is_asking
    assert operator.execute(bpy.context) == {"FINISHED"}
    assert len(at_once) == 1 and (at_once[0] is operator) != is_asking
    operator.execute(bpy.context)
    assert at_once[-1] is operator
