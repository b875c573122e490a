# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of the looks' menu: `python blend_samples/pictures/look_pictures.py` draws a lock of hair in each look.

Writes hair_addon/blender/ui/look_pictures/PRESET.png, drawn by Vellus with a transparent background.
"""

import math
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from hair_addon.core.shading.presets import PRESETS

OUT = Path(hair_addon.__file__).parent / "blender" / "ui" / "look_pictures"
SIZE = 96  # pixels
LENGTH = 0.1  # [m]


def main():
    """Draw every look."""
    hair_addon.register()
    hair = grow_lock()
    light()
    OUT.mkdir(exist_ok=True)
    bpy.context.view_layer.objects.active = hair
    for preset in PRESETS:
        bpy.ops.vellus.apply_preset(preset=preset)
        picture = {"width": SIZE, "height": SIZE, "samples_per_side": 4, "is_transparent": True}
        bpy.ops.vellus.render_picture(filepath=str(OUT / f"{preset}.png"), **picture)


def grow_lock():
    """A lock that hangs from a small patch in a wave; returns the hair object."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0.0, 0.0, 0.5 * LENGTH))
    patch = bpy.context.object
    patch.data.transform(((0.062, 0, 0, 0), (0, 0.016, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
    patch.hide_render = True
    bpy.ops.vellus.add_hair(
        guide_count=60, length=LENGTH, length_variation=0.1, tilt=0.0, gravity=0.0, strand_count=4000, radius=8e-5
    )
    guides = bpy.data.objects["Hair Guides"]
    hang(guides.data)
    bpy.context.view_layer.update()
    patch.hide_set(True)
    guides.hide_set(True)
    return bpy.data.objects["Hair"]


def hang(curves):
    """Let guides fall from their roots in a wave, closer to each other toward their tips."""
    points = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    strands = points.reshape(len(curves.curves), -1, 3)
    roots = strands[:, :1].copy()
    along = np.linspace(0.0, 1.0, strands.shape[1])[None, :]
    strands[..., 0] = roots[..., 0] * (1.0 - 0.45 * along**2) + 0.009 * np.sin(2.0 * math.pi * along)
    strands[..., 1] = roots[..., 1] - 0.006 * np.sin(2.0 * math.pi * along)
    strands[..., 2] = roots[..., 2] - LENGTH * along
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    curves.update_tag()


def light():
    """A camera in front, a key light, and a rim light that shines through."""
    scene = bpy.context.scene
    camera = scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.02 * LENGTH
    camera.location, camera.rotation_euler = (0.0, -1.0, 0.0), (math.radians(90.0), 0.0, 0.0)
    scene.collection.objects.link(camera)
    for name, location, strength in (("Key", (0.6, -1.0, 1.1), 4.0), ("Rim", (-0.7, 0.9, 0.8), 3.0)):
        sun = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        sun.data.energy = strength
        sun.rotation_euler = Vector(location).to_track_quat("Z", "Y").to_euler()
        scene.collection.objects.link(sun)
    world = scene.world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.35, 0.35, 0.35, 1.0)
    bpy.context.view_layer.update()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
