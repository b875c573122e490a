# SPDX-License-Identifier: GPL-3.0-or-later
"""*Paint* gives a map a source that does not change the hair, and enters its paint mode; the hair follows the paint."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import selection
from hair_addon.blender.settings import map_items

COLOR = (0.3, 0.2, 0.1)
MODES = {"IMAGE": "PAINT_TEXTURE", "GROUP": "PAINT_WEIGHT", "ATTRIBUTE": "PAINT_VERTEX"}


@pytest.fixture
def painted(hair):
    """Begin to paint a map of a setting of the hair; returns the map."""

    def begin(setting, kind):
        api.shade(hair.data, color=COLOR)
        bpy.context.view_layer.objects.active = hair
        map_items.add(hair.data.vellus, setting).kind = kind
        assert bpy.ops.vellus.paint_map(setting=setting) == {"FINISHED"}
        bpy.context.view_layer.update()
        return map_items.item_of(hair.data.vellus, setting)

    yield begin
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def root_absorption(hair):
    return strand_maps.read_looks(hair.data).root


@pytest.mark.parametrize("kind", MODES)
def test_a_new_source_leaves_the_hair_as_it_was(hair, painted, kind):
    """A new source keeps lengths and radii exactly and colors within a step of 8 bits; the paint mode is that of the
    kind.
    """
    before, radii = curves.read_points(hair.data), curves.read_radii(hair.data)
    item = painted("strands.strand_length", kind)
    assert bpy.context.mode == MODES[kind]
    assert bpy.context.object == bpy.data.objects["Sphere"]
    assert selection.hair_of(bpy.context.object) == hair.data
    assert map_items.is_set(item)
    np.testing.assert_allclose(curves.read_points(hair.data), before, atol=2e-6)
    np.testing.assert_array_equal(curves.read_radii(hair.data), radii)
    assert hair.data.vellus.status == ""


@pytest.mark.parametrize("kind", ["IMAGE", "ATTRIBUTE"])
def test_new_colors_are_those_of_the_setting(hair, painted, kind):
    """A new image or attribute has the setting's color, so each strand keeps its absorption."""
    painted("look.color", kind)
    found = root_absorption(hair)
    api.clear_map(hair.data, "look.color")
    painted_none = api.set_map(hair.data, "look.color", "strand", amount=0.0)
    assert painted_none.amount == 0.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(found, root_absorption(hair), rtol=0.02)


def test_the_hair_follows_what_is_painted(hair, painted):
    """Weights painted in Weight Paint mode cut strands in the same update."""
    before = curves.read_points(hair.data)
    item = painted("strands.strand_length", "GROUP")
    sphere = bpy.context.object
    sphere.vertex_groups[item.source].add(range(len(sphere.data.vertices)), 0.5, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    moved = np.linalg.norm(curves.read_points(hair.data) - before, axis=1)
    assert np.median(moved.reshape(len(hair.data.curves), -1)[:, -1]) > 0.01


@pytest.mark.parametrize(("kind", "source", "sentence"), [("STRAND", "", "change the kind"), ("ATTRIBUTE", "no", "no")])
def test_what_cannot_be_painted_is_refused(hair, kind, source, sentence):
    """Random maps and attributes without colors are refused with a sentence, and nothing is created."""
    bpy.context.view_layer.objects.active = hair
    item = map_items.add(hair.data.vellus, "look.color")
    item.kind, item.source = kind, source
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.vellus.paint_map(setting="look.color")
    assert bpy.context.mode == "OBJECT"
    assert not bpy.data.objects["Sphere"].data.color_attributes
