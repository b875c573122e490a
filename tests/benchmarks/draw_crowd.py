# SPDX-License-Identifier: GPL-3.0-or-later
"""Times for drawing many heads that share their hair: milliseconds for a frame, with all strands and with fewer.

.venv/bin/python tests/benchmarks/draw_crowd.py --strands 100000 --heads 1 10 100
"""

import argparse
import math
import os
import sys
from functools import partial
from pathlib import Path

import bpy
import gpu
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.render import drawn_scene
from tests.benchmarks.draw_frames import Frame, median_milliseconds

SPACING = 0.4  # [m] between neighboring heads


def copies(objects, count):
    """Show linked copies of a head and its hair in a grid that faces the camera, count with the original; returns
    its width [m].
    """
    side = math.ceil(math.sqrt(count))
    for place in range(1, count):
        column, row = place % side, place // side
        copied = [one.copy() for one in objects]
        copied[1].parent = copied[0]
        copied[0].location = (column * SPACING, 0.3 * row * SPACING, row * SPACING)
        for one in copied:
            bpy.context.scene.collection.objects.link(one)
    bpy.context.view_layer.update()
    return side * SPACING


def look_at_all(width):
    """Move the camera back until it sees a grid of some width [m] at the original head."""
    camera = bpy.context.scene.camera
    middle = head.LOOK_AT.copy()
    middle.x += 0.5 * (width - SPACING)
    middle.z += 0.5 * (width - SPACING)
    camera.location = middle.copy()
    camera.location.y -= 1.1 * width * camera.data.lens / min(camera.data.sensor_width, camera.data.sensor_height)
    camera.data.clip_end = 1000.0
    head.point_at(camera, middle)
    bpy.context.view_layer.update()


def main():
    """Print a row of milliseconds for each number of heads."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--heads", type=int, nargs="+", default=[1, 10, 100])
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    print("{} × {}, on {}, median [ms]".format(*options.size, gpu.platform.renderer_get()))
    for count in options.heads:
        surface = head.build()
        _guides, hair = head.grow(surface, strand_count=options.strands)
        head.light()
        look_at_all(copies([surface, hair], count))
        frame, found = Frame(*options.size, 1), {}
        for is_reduced in (False, True):
            hair.data.vellus.is_reduced_in_viewport = is_reduced
            bpy.context.view_layer.update()
            drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
            assert len(drawn.hair) == count
            found[is_reduced] = median_milliseconds(partial(frame.draw, drawn))
        print(f"{count:5} heads  all strands {found[False]:9.2f}  reduced {found[True]:9.2f}", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
