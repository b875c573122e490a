# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces by Cycles and hair by Vellus in one picture: *Composite Hair* on the sample head.

Writes composite.png to a folder, side by side: surfaces alone, hair alone, and both.
"""

import argparse
import os
import sys
from pathlib import Path

import bpy
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.sheets import picture_files

SIZE = (204, 258)


def main():
    """Render the three pictures, write them side by side."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/composite"))
    parser.add_argument("--strands", type=int, default=30_000)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--engine", choices=("CYCLES", "BLENDER_EEVEE"), default="CYCLES")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    hair_addon.register()
    wp.config.log_level = wp.LOG_WARNING
    build(options)
    scene = bpy.context.scene
    hair = [o for o in scene.objects if o.type == "CURVES" and not o.hide_render]
    for hair_object in hair:
        hair_object.hide_render = True
    pictures = [picture_files.rendered()]
    for hair_object in hair:
        hair_object.hide_render = False
    bpy.ops.vellus.toggle_composite()
    pictures += [_hair_alone(scene.vellus.hair_scene), picture_files.rendered()]
    picture_files.write(np.concatenate(pictures, axis=1), options.out.resolve() / "composite.png")


def build(options):
    """The head in light from beside and above, which throws the shadow of its hair on cheek and neck."""
    head_object = head.build()
    portrait.dress(head_object)
    _guides, hair = portrait.grow(head_object, strand_count=options.strands)
    portrait.make_auburn(hair.data)
    head.light()
    for name, watts, location in (("Key", 34.0, (0.75, 0.15, 1.75)), ("Rim", 18.0, (-0.35, 1.05, 1.25))):
        bpy.data.lights[name].energy, bpy.data.lights[name].size = watts, 0.15
        bpy.data.objects[name].location = location
        head.point_at(bpy.data.objects[name], head.LOOK_AT)
    bpy.data.lights["Fill"].energy = 6.0
    scene = bpy.context.scene
    scene.camera.data.lens = 105.0
    scene.render.engine = options.engine
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.cycles.samples, scene.eevee.taa_render_samples = options.samples, options.samples
    scene.cycles.use_denoising = True
    scene.vellus.sample_count = options.samples
    bpy.context.view_layer.update()


def _hair_alone(hair_scene):
    """Return (height, width, 3) uint8 of the scene that renders hair, over gray, by the view transform of the first."""
    scene = bpy.context.scene
    wanted = scene.view_settings
    hair_scene.view_settings.view_transform, hair_scene.view_settings.look = wanted.view_transform, wanted.look
    path = str(Path(bpy.app.tempdir) / "hair.png")
    settings = hair_scene.render.image_settings
    settings.file_format, settings.color_mode = "PNG", "RGBA"
    hair_scene.render.filepath = path
    bpy.ops.render.render(write_still=True, scene=hair_scene.name)
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels, np.float32).reshape(SIZE[1], SIZE[0], 4)[::-1]
    over = pixels[..., :3] * pixels[..., 3:] + 0.35 * (1.0 - pixels[..., 3:])
    return np.round(255.0 * over).astype(np.uint8)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
