# SPDX-License-Identifier: GPL-3.0-or-later
"""Times for drawing hair on the sample head: milliseconds for upload, shadow maps and a frame.

.venv/bin/python tests/benchmarks/draw_frames.py --strands 10000 100000
"""

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import ambient_visibility, drawing, hair_shading, strand_textures, visibility_buffer
from hair_addon.blender.render import drawn_scene, scene_drawing
from hair_addon.core.grooming import following, groom
from hair_addon.core.shading.fibre import kajiya_kay, strand_variation
from hair_addon.core.shading.tables import lookup_tables, strand_tables

REPETITIONS = 15


def median_milliseconds(work, repetitions=REPETITIONS):
    """Return the median time of a call [ms], after two calls that compile and warm up."""
    times = []
    for _ in range(repetitions + 2):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return float(np.median(times[2:]))


class Frame:
    """A picture with a number of samples per pixel, seen from the scene's camera."""

    def __init__(self, width, height, samples_per_side):
        width, height = width * samples_per_side, height * samples_per_side
        depsgraph = bpy.context.evaluated_depsgraph_get()
        camera = scene.read_camera(bpy.context.scene, depsgraph, width, height)
        self.view = drawing.pass_record(*camera, (width, height))
        self._buffer = visibility_buffer.VisibilityBuffer(width, height)
        self._pixel = gpu.types.GPUTexture((1, 1), format="RGBA16F")
        self._end = gpu.types.GPUFrameBuffer(color_slots=self._pixel)

    def draw(self, drawn):
        """Draw a `DrawnScene` as in a viewport whose surfaces Blender shades, and wait for the end."""
        with self._buffer.hiding():
            scene_drawing.draw_hiding(drawn, self.view)
        scene_drawing.draw_hair(drawn, self.view, self._buffer)
        self.wait()

    def wait(self):
        """Wait for all previous drawing, by reading a pixel."""
        with self._end.bind():
            drawing.resolve(self._buffer.color, 1)
            self._end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")


def strands_between(guides, strand_count, device):
    """Return (S, 41, 3) local points and (S, 41) radii, float32, as the operator would generate them."""
    surface_object = guides.data.surface
    depsgraph = bpy.context.evaluated_depsgraph_get()
    surface = scene.read_surface(surface_object, depsgraph)
    density = scene.read_vertex_group(surface_object, depsgraph, "scalp")
    settings = groom.HairSettings(strand_count=strand_count, radius=6e-5)
    rooted = curves.read_guides(guides.data, surface, "cpu")
    binding = groom.bind_hair(surface.mesh, rooted, settings, density=density, device=device)
    hair = following.follow_guides(binding, rooted, None)
    points = surface.to_local(hair.numpy())
    radii = np.broadcast_to(groom.strand_radii(settings), points.shape[:2])
    return points, radii


def measure(drawn, frame, points, radii):
    """Return {stage: milliseconds} for these strands in place of the scene's hair."""
    _strands, _shading, to_world, *growing_on = drawn.hair[0]
    uploaded = [strand_textures.upload_strands(points, radii)]

    def upload():
        uploaded.clear()  # not two of them at a time
        uploaded.append(strand_textures.upload_strands(points, radii))
        frame.wait()

    def draw_shadows():
        drawn.shadow_maps.draw(drawn.lights, [(uploaded[0], to_world)], [surface for surface, _parts in drawn.surfaces])
        frame.wait()

    def see_world():
        surfaces = [surface for surface, _parts in drawn.surfaces]
        seen = ambient_visibility.measure([(uploaded[0], to_world)], surfaces, [0.6], surfaces)
        frame.wait()
        return seen

    found = {
        "upload": median_milliseconds(upload, 3),
        "shadow maps": median_milliseconds(draw_shadows),
        "visibility": median_milliseconds(see_world, 3),
    }
    seen, _surfaces = see_world()
    for label, shading in shadings().items():
        shown = replace(drawn, hair=[(uploaded[0], shading, to_world, *growing_on)], hair_visibility=seen)
        found[label] = median_milliseconds(lambda shown=shown: frame.draw(shown))
    return found


def shadings():
    """Return {model: `Shading`} of the timed models."""
    fibres = {mode: lookup_tables.Settings(mode=mode, sigma_a=head.CHESTNUT) for mode in ("classic", "energy")}
    variation = strand_variation.Settings(pigment=head.CHESTNUT, random_color=0.5, tip_absorption=0.5)
    return {
        "Kajiya-Kay": hair_shading.kajiya_kay_shading(kajiya_kay.Settings()),
        "Marschner": hair_shading.marschner_shading(lookup_tables.bake(fibres["classic"])),
        "dual scattering": hair_shading.marschner_shading(lookup_tables.bake(fibres["energy"])),
        "the same, strands that differ": hair_shading.marschner_strand_shading(
            strand_tables.bake(fibres["energy"], variation)
        ),
    }


def main():
    """Print a row of milliseconds for each number of strands."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--samples-per-side", type=int, default=1, help="samples along each side of a pixel")
    parser.add_argument("--device", default="cpu", help="the Warp device that makes the strands")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    guides, _hair = head.grow(head.build(), strand_count=1000)
    head.light()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
    frame = Frame(*options.size, options.samples_per_side)
    print(
        "{} × {}, {} samples a pixel, on {}, {}, median [ms]".format(
            *options.size, options.samples_per_side**2, gpu.platform.renderer_get(), gpu.platform.backend_type_get()
        )
    )
    for strand_count in options.strands:
        found = measure(drawn, frame, *strands_between(guides, strand_count, options.device))
        print(f"{strand_count:9} strands", *(f"  {name} {value:8.2f}" for name, value in found.items()), flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
