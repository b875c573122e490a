# SPDX-License-Identifier: GPL-3.0-or-later
"""Frozen points of guides keep their bits while other points are combed, with and without layers."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves, frozen_points
from tests.support.reading import points, write_points

SELECTED = ".selection"


@pytest.fixture
def guides(hair):
    """Return guides in Sculpt Mode: all points of every second guide and the first half of the third guide are
    frozen.
    """
    found = bpy.data.objects["Guides"]
    found.data.vellus.keeps_outside = False
    bpy.context.view_layer.objects.active = found
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    selection = np.zeros(points(found).shape[:2], bool)
    selection[::2] = True
    selection[3, : selection.shape[1] // 2] = True
    attribute = found.data.attributes.get(SELECTED) or found.data.attributes.new(SELECTED, "BOOLEAN", "POINT")
    attribute.data.foreach_set("value", selection.ravel())
    assert bpy.ops.vellus.freeze_selected() == {"FINISHED"}
    assert np.array_equal(frozen_points.read(found.data), selection.ravel())
    yield found
    if found.name in bpy.data.objects:
        bpy.ops.object.mode_set(mode="OBJECT")


def comb(found, by=0.2):
    """Move all points sideways as a brush does, more toward the tip; returns the points."""
    bpy.context.view_layer.update()
    shape = points(found)
    shape = shape + np.linspace(0.0, by, shape.shape[1], dtype=np.float32)[None, :, None] * np.float32([1.0, 0.0, 0.0])
    write_points(found, shape)
    found.data.update_tag()
    bpy.context.view_layer.update()
    return shape


@pytest.mark.parametrize("has_layer", [False, True])
def test_strokes_leave_frozen_points(guides, has_layer):
    if has_layer:
        api.add_layer(guides)
    before = points(guides)
    frozen = frozen_points.read(guides.data).reshape(before.shape[:2])
    for _event in range(2):
        wanted = comb(guides)
    assert np.array_equal(points(guides)[frozen], before[frozen])
    np.testing.assert_allclose(points(guides)[~frozen], wanted[~frozen], atol=1e-6)
    assert curves.is_combed(guides.data) != has_layer
    if has_layer:
        guides.data.vellus.layers[0].weight = 0.0
        bpy.context.view_layer.update()
        np.testing.assert_allclose(points(guides), before, atol=1e-6)


def test_guide_tools_leave_frozen_points(guides):
    before = points(guides)
    frozen = frozen_points.read(guides.data).reshape(before.shape[:2])
    api.change_guides(guides, "LENGTH", factor=0.5, selected_only=False)
    assert np.array_equal(points(guides)[frozen], before[frozen])
    assert np.abs(points(guides)[1] - before[1]).max() > 0.1


def test_frozen_points_are_inverted_and_freed(guides):
    frozen = frozen_points.read(guides.data)
    bpy.ops.vellus.invert_frozen()
    assert np.array_equal(frozen_points.read(guides.data), ~frozen)
    bpy.ops.vellus.unfreeze_all()
    assert frozen_points.FROZEN not in guides.data.attributes
    wanted = comb(guides)
    assert np.array_equal(points(guides), wanted)


def test_settings_still_grow_frozen_guides(guides):
    bpy.ops.object.mode_set(mode="OBJECT")
    before = points(guides)
    guides.data.vellus.guides.length *= 0.5
    bpy.context.view_layer.update()
    assert np.abs(points(guides) - before).max() > 0.1
