# SPDX-License-Identifier: GPL-3.0-or-later
"""make compare: the same head, hair, lights and settings by Cycles and by Vellus, as numbers and side by side.

Prints the mean colour of the hair in every picture and the ratio of the two, channel by channel; writes the pictures,
Cycles above Vellus, to a folder.
"""

import argparse
import math
import os
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import head  # beside this file

import hair_addon
from hair_addon.blender import drawing, drawn_scene, render, scene

WIDTH, HEIGHT, SAMPLES_PER_SIDE = 480, 270, 4
CYCLES_SAMPLES = 96

# (melanin, redness) of Principled Hair.
COLORS = {"black": (0.985, 0.1), "brown": (0.66, 0.25), "blond": (0.22, 0.3), "red": (0.5, 0.95)}

# Where the sun stands [rad]: turned about X, about Z; its strength; and the world's.
LIGHTS = {
    "front": (math.radians(60.0), math.radians(36.0), 3.0, 0.0),
    "back": (math.radians(-60.0), math.radians(36.0), 3.0, 0.0),
    "world": (0.0, 0.0, 0.0, 0.5),
}


def main():
    """Render, draw, measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/compare"))
    parser.add_argument("--strands", type=int, default=30_000)
    parser.add_argument("--colors", nargs="+", choices=COLORS, default=list(COLORS))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    head_object = head.build()
    guides, hair = head.grow(head_object, strand_count=options.strands)
    head.light()
    guides.hide_render = True
    sun = _only_a_sun()
    _prepare_cycles(head_object)
    print(f"{'hair':8}{'light':8}{'Cycles':>26}{'Vellus':>26}{'ratio':>24}")
    rows = []
    for color in options.colors:
        look = hair.data.vellus.appearance
        look.mode, look.roughness, look.cuticle_angle = "energy", 0.3, math.radians(2.0)
        look.parametrization, (look.melanin, look.redness) = "MELANIN", COLORS[color]
        bpy.context.view_layer.update()
        columns = []
        for light in LIGHTS:
            _set_light(sun, *LIGHTS[light])
            pictures = _cycles(options.out / f"{color}_{light}.exr"), _vellus()
            means = [p[..., :3].sum(axis=(0, 1)) / p[..., 3].sum() for p in pictures]
            ratio = means[1] / means[0]
            texts = ["  ".join(f"{value:7.4f}" for value in values) for values in (*means, ratio)]
            print(f"{color:8}{light:8}{texts[0]:>26}{texts[1]:>26}{texts[2]:>24}", flush=True)
            columns.append(np.concatenate([pictures[1], pictures[0]]))  # rows run upwards: Cycles on top
        rows.append(np.concatenate(columns, axis=1))
    sheet = np.concatenate(rows[::-1])
    sheet += (1.0 - sheet[..., 3:]) * np.array([0.05, 0.05, 0.05, 1.0])
    render.write_picture(sheet, options.out / "compare.png", bpy.context.scene)


def _only_a_sun():
    for lamp in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.angle = 0.0
    bpy.context.scene.collection.objects.link(sun)
    return sun


def _set_light(sun, about_x, about_z, strength, world):
    sun.rotation_euler = (about_x, 0.0, about_z)
    sun.data.energy = strength
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (world, world, world, 1.0)
    bpy.context.view_layer.update()


def _prepare_cycles(head_object):
    blender_scene = bpy.context.scene
    blender_scene.render.engine = "CYCLES"
    blender_scene.render.resolution_x, blender_scene.render.resolution_y = WIDTH, HEIGHT
    blender_scene.render.film_transparent = True
    blender_scene.render.image_settings.file_format = "OPEN_EXR"
    blender_scene.render.image_settings.color_mode = "RGBA"
    blender_scene.render.image_settings.color_depth = "32"
    cycles = blender_scene.cycles
    cycles.samples, cycles.use_denoising, cycles.seed = CYCLES_SAMPLES, False, 1
    cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 64
    cycles.sample_clamp_indirect = 0.0
    # The head shades and hides, but only hair is measured.
    head_object.is_holdout = True


def _cycles(path):
    """(H, W, 4) linear premultiplied pixels of the hair, path traced."""
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(HEIGHT, WIDTH, 4)


def _vellus():
    """(H, W, 4) linear premultiplied pixels of the hair, drawn: the head leaves depth and no colour."""
    context = bpy.context
    depsgraph = context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(context.scene, context.view_layer, depsgraph)
    width, height = WIDTH * SAMPLES_PER_SIDE, HEIGHT * SAMPLES_PER_SIDE
    view = drawing.view_record(*scene.read_camera(context.scene, depsgraph, WIDTH, HEIGHT), height)
    color = gpu.types.GPUTexture((width, height), format="RGBA16F")
    depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=color, depth_slot=depth)
    with framebuffer.bind():
        framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        gpu.state.color_mask_set(False, False, False, False)
        drawn_scene.draw_surfaces(drawn, view)
        gpu.state.color_mask_set(True, True, True, True)
        drawn_scene.draw_hair_depth(drawn, view)
        drawn_scene.draw_hair(drawn, view)
        pixels = np.array(framebuffer.read_color(0, 0, width, height, 4, 0, "FLOAT"), np.float32)
    blocks = pixels.reshape(HEIGHT, SAMPLES_PER_SIDE, WIDTH, SAMPLES_PER_SIDE, 4)
    return blocks.mean(axis=(1, 3))


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
