# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tools take our Curves: sculpt mode, hair node groups, Cycles and EEVEE."""

import math

import bpy
import numpy as np
import pytest

from tests.blender.reading import points

NODE_ASSETS = bpy.utils.system_resource("DATAFILES", path="assets/nodes") + "/procedural_hair_node_assets.blend"


@pytest.fixture
def node_group():
    """Appends a node group of Blender's hair assets by name."""

    def append(name):
        with bpy.data.libraries.load(NODE_ASSETS, link=False) as (_there, here):
            here.node_groups = [name]
        (group,) = here.node_groups
        assert group is not None, f"Blender ships no hair node group {name}"
        return group

    return append


@pytest.mark.parametrize("kind", ["guides", "hair"])
def test_sculpt_mode_opens(kind, request):
    made = request.getfixturevalue(kind)
    bpy.context.view_layer.objects.active = made
    before = points(made)
    assert bpy.ops.object.mode_set(mode="SCULPT_CURVES") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(points(made), before)


# Those that take hair and give hair, of the shipped groups.
HAIR_NODES = [
    "Attach Hair Curves to Surface",
    "Blend Hair Curves",
    "Braid Hair Curves",
    "Clump Hair Curves",
    "Create Guide Index Map",
    "Curl Hair Curves",
    "Displace Hair Curves",
    "Duplicate Hair Curves",
    "Frizz Hair Curves",
    "Hair Curves Noise",
    "Interpolate Hair Curves",
    "Redistribute Curve Points",
    "Restore Curve Segment Length",
    "Roll Hair Curves",
    "Rotate Hair Curves",
    "Set Hair Curve Profile",
    "Shrinkwrap Hair Curves",
    "Smooth Hair Curves",
    "Straighten Hair Curves",
    "Trim Hair Curves",
]


@pytest.mark.parametrize("name", HAIR_NODES)
def test_hair_nodes_evaluate_without_a_warning(hair, node_group, name):
    hair.modifiers.new(name, "NODES").node_group = node_group(name)
    bpy.context.view_layer.update()
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(evaluated.points), 3), np.float32)
    evaluated.attributes["position"].data.foreach_get("vector", positions.ravel())
    assert len(positions) and np.isfinite(positions).all()
    warnings = [w.message for w in hair.modifiers[name].node_warnings if w.type in {"WARNING", "ERROR"}]
    assert warnings == []


@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_EEVEE"])
def test_blender_renders_the_hair(hair, engine, tmp_path):
    """The same picture with and without hair differs outside the sphere's outline: strands are drawn, and lit."""
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.rotation_euler = (0.0, -8.0, 0.0), (math.pi / 2, 0.0, 0.0)
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    light.data.energy, light.rotation_euler = 5.0, (math.pi / 3, 0.0, 0.0)
    for new in (scene.camera, light):
        scene.collection.objects.link(new)
    scene.render.engine = engine
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent = True
    scene.cycles.samples, scene.eevee.taa_render_samples = 8, 4
    pictures = []
    for hidden in (False, True):
        hair.hide_render = bpy.data.objects["Guides"].hide_render = hidden
        scene.render.filepath = str(tmp_path / f"{hidden}.png")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pictures.append(np.array(image.pixels).reshape(64, 64, 4))
    with_hair, without = pictures
    outside = without[..., 3] == 0.0
    assert (with_hair[outside][:, 3] > 0.1).sum() > 50
    assert with_hair[outside][:, :3].max() > 0.02
