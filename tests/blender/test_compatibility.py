# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tools take our Curves: sculpt mode, hair node groups, Cycles and EEVEE."""

import math

import bpy
import numpy as np
import pytest

from tests.blender.reading import points


@pytest.mark.parametrize("kind", ["guides", "hair"])
def test_sculpt_mode_opens(kind, request):
    made = request.getfixturevalue(kind)
    bpy.context.view_layer.objects.active = made
    before = points(made)
    assert bpy.ops.object.mode_set(mode="SCULPT_CURVES") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(points(made), before)


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
