# SPDX-License-Identifier: GPL-3.0-or-later
"""The head rendered by the engine "Vellus" and laid over a backdrop by Blender's compositor; and its passes.

Writes composite.png, passes.png (hair mask, R, TT, TRT, scattered light, shadow) and head0001.exr to a folder.
"""

import argparse
import os
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait

SIZE = (960, 540)
STRIP = ("Hair Mask", "Hair R", "Hair TT", "Hair TRT", "Hair Scattered", "Shadow")
_GAIN = {"Hair R": 4.0, "Hair TT": 6.0, "Hair TRT": 8.0, "Hair Scattered": 2.0}  # dim ones are seen beside others


def main():
    """Render, composite, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/composite"))
    parser.add_argument("--strands", type=int, default=30_000)
    parser.add_argument("--samples", type=int, default=64)
    options = parser.parse_args()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    hair_addon.register()
    wp.config.log_level = wp.LOG_WARNING
    build(options.strands, options.samples)
    over_backdrop()
    render(out)
    write_strip(out / "head0001.exr", out / "passes.png")


def build(strand_count, sample_count):
    """The head in warm light from behind, rendered without a background and with all passes."""
    head_object = head.build()
    portrait.dress(head_object)
    _guides, hair = portrait.grow(head_object, strand_count=strand_count)
    portrait.make_auburn(hair.data)
    head.light()
    bpy.data.lights["Key"].energy, bpy.data.lights["Key"].color = 20.0, (1.0, 0.86, 0.74)
    bpy.data.lights["Rim"].energy, bpy.data.lights["Rim"].color = 75.0, (1.0, 0.72, 0.46)
    bpy.data.lights["Fill"].color = (0.55, 0.70, 1.0)
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    scene.camera.data.shift_x, scene.camera.data.shift_y, scene.camera.data.lens = -0.17, 0.06, 98.0
    scene.render.engine = "VELLUS"
    scene.vellus.sample_count = sample_count
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.film_transparent = True
    view_layer.use_pass_z = view_layer.use_pass_shadow = True
    view_layer.vellus.has_hair_mask = view_layer.vellus.has_lobes = True


def backdrop():
    """Return (height, width, 4) linear light: a street at dusk, far out of focus."""
    width, height = SIZE
    x, y = np.meshgrid((np.arange(width) + 0.5) / height, (np.arange(height) + 0.5) / height)
    sky, ground = np.array([0.020, 0.030, 0.075]), np.array([0.012, 0.009, 0.010])
    glow = np.array([0.60, 0.22, 0.07]) * np.exp(-(((y - 0.36) / 0.13) ** 2))[..., None]
    light = ground + (sky - ground) * np.clip((y - 0.25) / 0.4, 0.0, 1.0)[..., None] + 0.5 * glow
    rng = np.random.default_rng(8)
    for _lamp in range(60):
        place = rng.uniform((0.0, 0.20), (width / height, 0.62))
        radius, color = rng.uniform(0.020, 0.070), rng.choice([(1.0, 0.45, 0.12), (1.0, 0.70, 0.38), (0.35, 0.50, 1.0)])
        distance = np.hypot(x - place[0], y - place[1])
        disk = 1.0 / (1.0 + np.exp((distance - radius) * height / 2.5))
        light += rng.uniform(0.03, 0.5) * disk[..., None] * np.array(color)
    return np.concatenate([light, np.ones((height, width, 1))], axis=-1).astype(np.float32)


def over_backdrop():
    """Set up Blender's compositor to lay the render over the backdrop."""
    picture = bpy.data.images.new("Backdrop", *SIZE, float_buffer=True)
    picture.pixels.foreach_set(backdrop().ravel())
    tree = bpy.data.node_groups.new("Composite", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    behind, rendered = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("CompositorNodeRLayers")
    over, output = tree.nodes.new("CompositorNodeAlphaOver"), tree.nodes.new("NodeGroupOutput")
    behind.image = picture
    tree.links.new(behind.outputs["Image"], over.inputs["Background"])
    tree.links.new(rendered.outputs["Image"], over.inputs["Foreground"])
    tree.links.new(over.outputs["Image"], output.inputs["Image"])
    bpy.context.scene.compositing_node_group = tree


def render(out):
    """The composite as PNG; the passes, which the compositor leaves as they are, as multilayer EXR."""
    scene = bpy.context.scene
    settings = scene.render.image_settings
    for media, path in (("IMAGE", out / "composite.png"), ("MULTI_LAYER_IMAGE", out / "head0001.exr")):
        settings.media_type = media
        scene.render.filepath = str(path)
        if media == "IMAGE":
            settings.file_format, settings.color_mode = "PNG", "RGB"
            bpy.ops.render.render(write_still=True)
        else:
            bpy.data.images["Render Result"].save_render(str(path))


def _halved(plane):
    """Return the means of 2 × 2 blocks of a picture (2 H, 2 W)."""
    height, width = (length // 2 for length in plane.shape)
    return plane[: 2 * height, : 2 * width].reshape(height, 2, width, 2).mean(axis=(1, 3))


def write_strip(exr, path):
    """Passes side by side, by the scene's view transform, but for those that are no light."""
    with OpenEXR.File(str(exr), separate_channels=True) as file:
        channels = {n: np.array(c.pixels) for part in file.parts for n, c in part.channels.items()}
    columns = slice(int(0.42 * SIZE[0]), int(0.98 * SIZE[0]))
    pictures = []
    for name in STRIP:
        letters = "X" if name == "Hair Mask" else "RGB"
        planes = [_halved(channels[f"ViewLayer.{name}.{letter}"][:, columns]) for letter in letters]
        pictures.append(np.stack(planes * (3 // len(planes)), axis=-1) * _GAIN.get(name, 1.0))
    rows = [np.concatenate(pictures[i : i + 3], axis=1) for i in (0, 3)]
    strip = np.concatenate(rows)[::-1]
    height, width, _rgb = strip.shape
    image = bpy.data.images.new("Passes", width, height, float_buffer=True)
    image.pixels.foreach_set(np.concatenate([strip, np.ones((height, width, 1))], axis=-1).astype(np.float32).ravel())
    bpy.context.scene.view_settings.view_transform = "Standard"
    bpy.context.scene.view_settings.look = "None"
    settings = bpy.context.scene.render.image_settings
    settings.media_type, settings.file_format, settings.color_mode = "IMAGE", "PNG", "RGB"
    image.save_render(str(path))


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
