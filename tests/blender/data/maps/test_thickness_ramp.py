# SPDX-License-Identifier: GPL-3.0-or-later
"""The thickness curve replaces the straight line from root to tip by Blender's curve widget."""

import bpy
import numpy as np

from hair_addon.blender.data.maps import ramps
from hair_addon.blender.data.strands import curves
from hair_addon.blender.settings import map_items
from hair_addon.core.maps.map_settings import MapSettings
from tests.support import appended


def radii(hair):
    """Return (S, P) float32, the radii that hair Curves store."""
    return curves.read_radii(hair).reshape(len(hair.curves), -1)


def ramped(hair):
    """Return the radii of hair after its thickness curve was added."""
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.add_ramp() == {"FINISHED"}
    bpy.context.view_layer.update()
    return radii(hair.data)


def bend(tree, middle):
    """Add a point in the middle of a curve, as a click in the widget does."""
    mapping = ramps.node_of(tree).mapping
    mapping.curves[0].points.new(0.5, middle).handle_type = "VECTOR"
    mapping.update()
    tree.update_tag()
    bpy.context.view_layer.update()


def test_a_new_ramp_changes_nothing_and_a_bent_ramp_is_the_thickness(hair):
    """A new curve keeps the radii, a bent curve multiplies the radius by its values, and removing it restores the
    radii.
    """
    before = radii(hair.data)
    np.testing.assert_allclose(ramped(hair), before, rtol=1e-4)
    bend(hair.data.vellus.thickness_ramp, 0.1)
    found = radii(hair.data)[0] / before[0, 0]
    middle = len(found) // 2
    np.testing.assert_allclose(found[[0, middle, -1]], [1.0, 0.1, 0.2], atol=2e-3)
    np.testing.assert_allclose(found[middle // 2], 0.55, atol=5e-3)
    hair.data.vellus.hair.tip_taper = 0.9
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data)[0] / before[0, 0], found)
    hair.data.vellus.hair.tip_taper = 0.2
    assert bpy.ops.vellus.remove_ramp() == {"FINISHED"}
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data), before)
    assert not [tree for tree in bpy.data.node_groups if ramps.node_of(tree) is not None]


def test_a_map_multiplies_the_ramp(hair):
    """Each strand has the radii of the thickness curve times the factor of its map."""
    ramped(hair)
    bend(hair.data.vellus.thickness_ramp, 0.8)
    plain = radii(hair.data)
    map_items.keep(hair.data.vellus, MapSettings(setting="strands.thickness", kind="STRAND", low=0.5, high=0.5))
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data), np.float32(0.5) * plain)


def test_copies_undo_and_files_have_their_ramp(hair, tmp_path):
    """A copy of hair has its own thickness curve, undo restores an edited curve, and linked hair has the radii of its
    curve.
    """
    ramped(hair)
    bpy.ops.ed.undo_push(message="straight")
    straight = radii(hair.data)
    copy = hair.copy()
    copy.data = hair.data.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    bend(hair.data.vellus.thickness_ramp, 0.05)
    assert copy.data.vellus.thickness_ramp != hair.data.vellus.thickness_ramp
    np.testing.assert_array_equal(radii(copy.data), straight)
    bent = radii(hair.data)
    assert not np.allclose(bent, straight)
    path = str(tmp_path / "ramp.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.ops.ed.undo_push(message="bent")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(bpy.data.hair_curves["Hair"]), straight)
    for found in appended.in_new_files(path):
        assert ramps.node_of(found.vellus.thickness_ramp) is not None
        np.testing.assert_array_equal(radii(found), bent)


def test_a_damaged_ramp_is_ignored(hair):
    """If a node group has lost its curve node, the settings give the thickness, and the button adds another curve."""
    before = radii(hair.data)
    ramped(hair)
    tree = hair.data.vellus.thickness_ramp
    bend(tree, 0.5)
    tree.nodes.clear()
    tree.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data), before)
    ramped(hair)
    assert ramps.node_of(hair.data.vellus.thickness_ramp) is not None
