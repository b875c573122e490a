# SPDX-License-Identifier: GPL-3.0-or-later
"""make compare: the same head, hair, lights and settings by Cycles and by Vellus, as numbers and side by side.

Vellus renders as F12 does. Prints the mean color of the hair in every picture and the ratio of the two, channel by
channel; writes compare.png, the pictures with Cycles above Vellus, and ratios.png, the ratios as a plot, to a folder.
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

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.sheets import ratio_plot
from hair_addon import api
from hair_addon.blender.render import offscreen

WIDTH, HEIGHT = 400, 225
CYCLES_SAMPLES = 128  # by default
SAMPLES_PER_SIDE = 4  # of a pixel by Vellus
_SHOWN = slice(110, 310)  # columns of a picture that hair is in

# (melanin, redness) of Principled Hair.
COLORS = {"black": (0.985, 0.1), "brown": (0.66, 0.25), "blond": (0.22, 0.3), "red": (0.5, 0.95)}

# Where the sun stands [rad], turned about X and about Z, its strength, and the world: a gray, or a studio's picture.
LIGHTS = {
    "front": (math.radians(60.0), math.radians(36.0), 3.0, 0.0),
    "back": (math.radians(-60.0), math.radians(36.0), 3.0, 0.0),
    "world": (0.0, 0.0, 0.0, 0.5),
    "studio": (0.0, 0.0, 0.0, None),
}

# Lamps of the studio: longitude and latitude of the middle, half of the width and height [degrees], radiance.
_LAMPS = (
    (-120.0, 35.0, 14.0, 10.0, (26.0, 24.0, 21.0)),
    (-20.0, 10.0, 8.0, 25.0, (7.0, 8.0, 9.0)),
    (75.0, 40.0, 10.0, 10.0, (22.0, 24.0, 28.0)),
)


def main():
    """Render, draw, measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/compare"))
    parser.add_argument("--reuse", type=Path, help="folder with images by Cycles from an earlier run")
    parser.add_argument("--strands", type=int, default=30_000)
    parser.add_argument("--cycles-samples", type=int, default=CYCLES_SAMPLES, help="of each pixel by Cycles")
    parser.add_argument("--colors", nargs="+", choices=COLORS, default=list(COLORS))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    stage = Stage(options.strands, options.cycles_samples)
    print(f"{'hair':8}{'light':8}{'Cycles':>26}{'Vellus':>26}{'ratio':>24}")
    rows, ratios = [], {}
    for color in options.colors:
        columns = []
        for light in LIGHTS:
            stage.set(color, light)
            pictures = stage.by_cycles(color, light, options.out, options.reuse), stage.by_vellus()
            ratios[color, light] = ratio(*pictures)
            texts = ["  ".join(f"{value:7.4f}" for value in mean(picture)) for picture in pictures]
            texts.append("  ".join(f"{value:7.4f}" for value in ratios[color, light]))
            print(f"{color:8}{light:8}{texts[0]:>26}{texts[1]:>26}{texts[2]:>24}", flush=True)
            shown = [picture[:, _SHOWN] for picture in pictures]
            columns.append(np.concatenate(shown[::-1]))  # rows run upwards: Cycles on top
        rows.append(np.concatenate(columns, axis=1))
    sheet = np.concatenate(rows[::-1])
    sheet += (1.0 - sheet[..., 3:]) * np.array([0.05, 0.05, 0.05, 1.0])
    bpy.context.scene.view_settings.exposure = 1.0  # stops: the sun is kept dim, so that nothing clips
    offscreen.write_picture(sheet, options.out / "compare.png", bpy.context.scene)
    ratio_plot.write(ratios, options.out / "ratios.png")


def mean(picture):
    """Return (3,) mean color of the hair in a premultiplied picture (H, W, 4)."""
    return picture[..., :3].sum(axis=(0, 1)) / picture[..., 3].sum()


def ratio(by_cycles, by_vellus):
    """Return (3,) mean color by Vellus, relative to that by Cycles."""
    return mean(by_vellus) / mean(by_cycles)


class Stage:
    """The head with hair, a camera, a sun and a world, set for one comparison after the other."""

    def __init__(self, strand_count, cycles_samples):
        hair_addon.register()
        gpu.init()
        wp.config.log_level = wp.LOG_WARNING
        head_object = head.build()
        guides, self.hair = head.grow(head_object, strand_count=strand_count)
        head.light()
        guides.hide_render = True
        for lamp in [o for o in bpy.data.objects if o.type == "LIGHT"]:
            bpy.data.objects.remove(lamp)
        self.sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        self.sun.data.angle = 0.0
        bpy.context.scene.collection.objects.link(self.sun)
        self.world = bpy.context.scene.world.node_tree
        self.background = next(node for node in self.world.nodes if node.type == "BACKGROUND")
        self.studio = self.world.nodes.new("ShaderNodeTexEnvironment")
        self.studio.image = studio_image()
        self._prepare_cycles(head_object, cycles_samples)

    def set(self, color, light):
        """Colour the hair and light the scene, by names of `COLORS` and `LIGHTS`."""
        look = self.hair.data.vellus.appearance
        look.mode, look.roughness, look.cuticle_angle = "energy", 0.3, math.radians(2.0)
        look.parametrization, (look.melanin, look.redness) = "MELANIN", COLORS[color]
        about_x, about_z, strength, grey = LIGHTS[light]
        self.sun.rotation_euler = (about_x, 0.0, about_z)
        self.sun.data.energy = strength
        if grey is None:
            self.world.links.new(self.studio.outputs["Color"], self.background.inputs["Color"])
        else:
            for link in self.background.inputs["Color"].links:
                self.world.links.remove(link)
            self.background.inputs["Color"].default_value = (grey, grey, grey, 1.0)
        bpy.context.view_layer.update()

    def _prepare_cycles(self, head_object, sample_count):
        blender_scene = bpy.context.scene
        blender_scene.render.engine = "CYCLES"
        blender_scene.render.resolution_x, blender_scene.render.resolution_y = WIDTH, HEIGHT
        blender_scene.render.film_transparent = True
        blender_scene.render.image_settings.file_format = "OPEN_EXR"
        blender_scene.render.image_settings.color_mode = "RGBA"
        blender_scene.render.image_settings.color_depth = "32"
        cycles = blender_scene.cycles
        cycles.samples, cycles.use_denoising, cycles.seed = sample_count, False, 1
        cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 64
        cycles.sample_clamp_indirect = 0.0
        # The head shades and hides, but only hair is measured.
        head_object.is_holdout = True

    def by_cycles(self, color, light, out, reuse=None):
        """Return (H, W, 4) linear premultiplied pixels of the hair, path traced; written to a folder, or found in
        another.
        """
        name = f"{color}_{light}.exr"
        found = reuse / name if reuse else None
        if found is None or not found.is_file():
            found = out / name
            bpy.context.scene.render.filepath = str(found.resolve())
            bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(found.resolve()), check_existing=False)
        pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(HEIGHT, WIDTH, 4)

    def by_vellus(self):
        """Return (H, W, 4) linear premultiplied pixels of the hair, as a render has them."""
        return api.draw(width=WIDTH, height=HEIGHT, samples_per_side=SAMPLES_PER_SIDE, is_transparent=True)


def studio_image(width=512, height=256):
    """Return a picture of a studio by longitude and latitude: a dim room, three soft lamps."""
    longitude = 180.0 - 360.0 * (np.arange(width) + 0.5) / width
    latitude = 180.0 * (np.arange(height) + 0.5) / height - 90.0
    room = 0.12 + 0.10 * np.sin(np.radians(latitude))
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = room[:, None, None] * np.array([1.0, 0.95, 0.9])
    for middle, high, half_width, half_height, radiance in _LAMPS:
        columns = np.abs(longitude - middle) < half_width / np.cos(np.radians(high))
        rows = np.abs(latitude - high) < half_height
        pixels[np.ix_(rows, columns, range(3))] = radiance
    image = bpy.data.images.new("Studio", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
