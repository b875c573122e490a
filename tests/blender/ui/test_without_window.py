# SPDX-License-Identifier: GPL-3.0-or-later
"""Without a window there is no active object, and no function raises an exception."""

import bpy
import pytest

from hair_addon.blender.live import live_hair
from hair_addon.blender.ui import asset_shelf
from tests.support.reading import points


@pytest.fixture
def no_window(hair):
    """Return a context without a window, with hair in the scene."""
    with bpy.context.temp_override(window=None):
        assert not hasattr(bpy.context, "object")
        yield


def test_operators_that_need_an_active_object_are_not_offered(no_window):
    operators = {name: getattr(bpy.types, f"VELLUS_OT_{name}") for name in dir(bpy.ops.vellus)}
    offered = {
        name for name, operator in operators.items() if not hasattr(operator, "poll") or operator.poll(bpy.context)
    }
    assert offered == {"add_grooms", "remove_look", "remove_style_preset", "toggle_composite"}


def test_grooms_are_offered_where_a_mesh_is_active(no_window):
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert asset_shelf.VELLUS_AST_grooms.poll(bpy.context)
    bpy.context.view_layer.objects.active = None
    assert not asset_shelf.VELLUS_AST_grooms.poll(bpy.context)


def test_hair_follows_its_settings(no_window, hair):
    hair.data.vellus.hair.strand_count = 70
    bpy.context.view_layer.update()
    live_hair.write_all()
    assert len(points(hair)) == 70
