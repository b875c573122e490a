# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of a viewport's frame with hair drawn by Vellus and with the same strands drawn by Blender, and their ratios.

.venv/bin/python tests/benchmarks/draw_beside_blender.py --strands 30000 100000

Each is a redraw of a view that turns, surfaces and all: Blender's as Solid and as Material Preview, with one sample a
pixel as in its windows, strands as strips and as lines, from poly lines and from Catmull-Rom curves; ours is the Solid
frame with a pass of the hair laid over it.
"""

import argparse
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.data import scene
from hair_addon.blender.gpu.display_transform import DisplayTransform
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import hair_picture, viewport
from tests.benchmarks.draw_frames import median_milliseconds

NATIVE = [
    (shading, hair_type, kind)
    for shading in ("SOLID", "MATERIAL")
    for hair_type, kind in (("STRIP", "POLY"), ("STRAND", "POLY"), ("STRAND", "CATMULL_ROM"))
]


@dataclass
class View:
    """The 3-D viewport of Blender's own start-up screen, looking through the scene's camera into a picture."""

    size: tuple

    def __post_init__(self):
        area = next(a for a in bpy.context.screen.areas if a.type == "VIEW_3D")
        self.space = area.spaces.active
        self.space.overlay.show_overlays = False
        self.region = next(r for r in area.regions if r.type == "WINDOW")
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.world_to_view, self.view_to_clip = scene.read_camera(bpy.context.scene, depsgraph, *self.size)
        bpy.context.preferences.system.viewport_aa = "OFF"
        bpy.context.scene.eevee.taa_samples = 1
        self.picture = gpu.types.GPUOffScreen(*self.size, format="RGBA16F")

    def turn(self):
        """Turn the view a little, as Blender does not redraw a view at rest."""
        step = np.eye(4)
        step[:2, :2] = [[np.cos(0.003), -np.sin(0.003)], [np.sin(0.003), np.cos(0.003)]]
        self.world_to_view = self.world_to_view @ step

    def draw(self):
        """Blender's own drawing of the scene."""
        self.turn()
        context = bpy.context
        self.picture.draw_view3d(
            context.scene,
            context.view_layer,
            self.space,
            self.region,
            _matrix(self.world_to_view),
            _matrix(self.view_to_clip),
            do_color_management=False,
        )

    def read(self, width, height):
        """Return the picture's corner (height, width, 4) float32, once all is drawn."""
        with self.picture.bind():
            pixels = gpu.state.active_framebuffer_get().read_color(0, 0, width, height, 4, 0, "FLOAT")
        return np.array(pixels, np.float32).reshape(height, width, 4)


def _matrix(values):
    return Matrix(values.tolist())


def by_vellus(view):
    """Return a function that draws a frame as the add-on does in a viewport."""
    context = bpy.context
    drawn = drawn_scene.read(context.scene, context.view_layer, context.evaluated_depsgraph_get())
    picture = hair_picture.HairPicture(view.size)
    table = hair_picture.table_texture(DisplayTransform.of(context.scene).table())

    def draw():
        view.draw()
        picture.restart()
        picture.add_pass(drawn, view.world_to_view, view.view_to_clip)
        with view.picture.bind():
            picture.show(table, 1.0, depth_test="ALWAYS")

    return draw


def main():
    """Print milliseconds, and the ratio of Blender's time to ours."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--out", type=Path, help="folder for a picture of each")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    guides, hair = head.grow(head.build(), strand_count=1000)
    guides.hide_set(True)
    head.light()
    viewport.unregister()  # what is timed is called here
    view = View(tuple(options.size))
    print(f"{options.size} on {gpu.platform.renderer_get()}, {gpu.platform.backend_type_get()}, median [ms]")
    for strand_count in options.strands:
        hair.data.vellus.hair.strand_count = strand_count
        bpy.context.view_layer.update()

        def frame(draw, name, label, strand_count=strand_count):
            milliseconds = median_milliseconds(lambda: (draw(), view.read(1, 1)), options.repetitions)
            if options.out:
                save(view.read(*view.size), options.out / f"{strand_count}_{name}.png")
            print(f"{strand_count:9} strands  {label:44} {milliseconds:10.1f}", end="", flush=True)
            return milliseconds

        hair.display_type = "WIRE"
        view.space.shading.type = "SOLID"
        frame(view.draw, "none", "no hair")
        print()
        ours = frame(by_vellus(view), "vellus", "Vellus, Marschner with shadows")
        print()
        hair.display_type = "TEXTURED"
        for shading, hair_type, kind in NATIVE:
            view.space.shading.type = shading
            bpy.context.scene.render.hair_type = hair_type
            hair.data.set_types(type=kind)
            bpy.context.view_layer.update()
            label = f"Blender, {shading.title()}, {kind.replace('_', '-').lower()}, {hair_type.lower()}s"
            native = frame(view.draw, f"{shading}_{kind}_{hair_type}".lower(), label)
            print(f"   {native / ours:6.1f} times ours")
        hair.data.set_types(type="POLY")


def save(pixels, path):
    """Write a picture as it is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image = bpy.data.images.new("Frame", pixels.shape[1], pixels.shape[0], float_buffer=False)
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
