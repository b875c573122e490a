# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering of scenes to files, and reading of these."""

import math

import bpy
import numpy as np
import OpenEXR


def add_orthographic_camera(scene):
    """Add an orthographic camera along Y at two meters."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    camera.location, camera.rotation_euler = (0.0, -4.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera


def rendered(folder, **settings):
    """Return {pass: (height, width) or (height, width, channels) float32}, first row at the bottom, of the active
    view layer.

    The scene is rendered by our engine to an EXR with all its passes; settings: of the scene's `render`, or of its own
    settings of ours.
    """
    return layers_of(folder, **settings)[bpy.context.view_layer.name]


def layers_of(folder, **settings):
    """Render and return {view layer: {pass: array}} of every view layer."""
    configure(**settings)
    render, path = bpy.context.scene.render, folder / "rendered.exr"
    render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.color_depth = "32"
    render.filepath = str(path)
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    return read_layers(path)


def configure(**settings):
    """Set up a small picture by our engine, with other settings as given."""
    scene = bpy.context.scene
    settings = {
        "engine": "VELLUS",
        "resolution_x": 96,
        "resolution_y": 72,
        "sample_count": 4,
        "filter_size": 0.0,
    } | settings
    for name, value in settings.items():
        setattr(scene.vellus if hasattr(scene.vellus, name) else scene.render, name, value)


def read_layers(path):
    """Return {view layer: {pass: array}} of a multilayer EXR."""
    found = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for part in file.parts:
            for name, channel in part.channels.items():
                layer, render_pass, letter = name.split(".")
                channels = found.setdefault(layer, {}).setdefault(render_pass, {})
                channels[letter] = np.array(channel.pixels, np.float32)[::-1]
    return {layer: {name: _stacked(channels) for name, channels in passes.items()} for layer, passes in found.items()}


def _stacked(channels):
    order = sorted(channels, key="UVRGBAXYZW".index)
    return channels[order[0]] if len(order) == 1 else np.stack([channels[letter] for letter in order], axis=-1)


def light_up(color=(0.2, 0.3, 0.4)):
    """Set a world of this color."""
    world = bpy.context.scene.world or bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1.0)
