# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender without a window, the add-on registered as Blender would, and scenes to grow hair in."""

import bpy
import gpu
import numpy as np
import pytest

import hair_addon
from tests.blender.reading import vertex_positions


@pytest.fixture(scope="session", autouse=True)
def blender():
    """The add-on in Blender, with graphics."""
    hair_addon.register()
    gpu.init()
    yield
    hair_addon.unregister()


@pytest.fixture
def scene():
    """An empty scene, undo ready."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.edit.use_global_undo = True
    return bpy.context.scene


@pytest.fixture
def sphere(scene):
    """A sphere of one metre with a UV map and a vertex group `top` on its upper half; active."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
    sphere = bpy.context.object
    sphere.name = "Sphere"
    group = sphere.vertex_groups.new(name="top")
    positions = vertex_positions(sphere)
    group.add([int(i) for i in np.flatnonzero(positions[:, 2] > 0.0)], 1.0, "REPLACE")
    bpy.ops.ed.undo_push(message="sphere")
    return bpy.context.object


@pytest.fixture
def guides(sphere):
    """60 guides on the sphere; their object is active."""
    bpy.ops.vellus.distribute_guides(guide_count=60, length=0.5)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    return bpy.data.objects["Guides"]


@pytest.fixture
def hair(guides):
    """500 strands between the guides; their object is active."""
    bpy.ops.vellus.interpolate_hair(strand_count=500, radius=0.004)
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    return bpy.data.objects["Hair"]
