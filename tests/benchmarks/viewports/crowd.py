# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked sample heads in one viewport: times of a frame while the view turns and of a pass at rest, and what is drawn.

.venv/bin/python tests/benchmarks/viewports/crowd.py --heads 100 --strands 100000

`--host` leaves out compute programs and surfaces: what remains is the processor's time for hair.
"""

import argparse
import math
import os
import sys
import time
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import hair_addon
from blend_samples.heads import head
from hair_addon.blender.data import scene
from hair_addon.blender.gpu import drawing, level_of_detail, strand_textures
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import hair_picture

FRAMES = 30
TURN = 0.005  # of the view from frame to frame [radians]
SPACE = 0.6  # between heads [m]


def link_heads(head_object, hair_objects, count):
    """Link copies of a head and its hair in a square, with the data of the first."""
    side = math.ceil(math.sqrt(count))
    for index in range(1, count):
        copied = head_object.copy()
        copied.location.x += SPACE * (index % side)
        copied.location.y += SPACE * (index // side)
        bpy.context.scene.collection.objects.link(copied)
        for hair in hair_objects:
            other = hair.copy()
            other.parent = copied
            bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    return SPACE * (side - 1)


def camera_of(middle, distance, angle, size):
    """Return (world to view, view to clip) of a camera that looks at a place from above, turned around it."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    _view, view_to_clip = scene.read_camera(bpy.context.scene, depsgraph, *size)
    tilt = np.radians(35.0)
    cosine, sine = np.cos(angle), np.sin(angle)
    back = np.array([sine * np.cos(tilt), -cosine * np.cos(tilt), np.sin(tilt)])
    right = np.array([cosine, sine, 0.0])
    world_to_view = np.eye(4)
    world_to_view[:3, :3] = right, np.cross(back, right), back
    world_to_view[:3, 3] = -world_to_view[:3, :3] @ (middle + distance * back)
    return world_to_view, view_to_clip


class Times:
    """Milliseconds of frames; waits: measure until the GPU has finished, otherwise the processor without surfaces."""

    def __init__(self, waits):
        self.waits, self.found = waits, []
        self._pixel = gpu.types.GPUTexture((1, 1), format="RGBA16F")
        self._end = gpu.types.GPUFrameBuffer(color_slots=self._pixel)

    def add(self, picture, drawn, camera):
        """Measure a pass of a picture."""
        clock = time.perf_counter if self.waits else time.process_time
        started = clock()
        picture.add_pass(drawn, *camera, is_see_through=not self.waits)
        if self.waits:
            with self._end.bind():
                drawing.resolve(picture._color, 1)
                self._end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
        self.found.append(1e3 * (clock() - started))

    def __str__(self):
        return f"median {np.median(self.found):.2f} ms, least {min(self.found):.2f}"


def main():
    """Print times and numbers of a crowd."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--heads", type=int, default=100)
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--distance", type=float, default=1.5, help="of the camera, in widths of the crowd")
    parser.add_argument("--host", action="store_true", help="leave out compute programs")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    guides, hair = head.grow(head.build(), strand_count=options.strands)
    head.light()
    surface = guides.data.surface
    width = max(link_heads(surface, [hair], options.heads), SPACE)
    uploads, upload = [], strand_textures.upload_strands
    strand_textures.upload_strands = lambda *given, **named: uploads.append(1) or upload(*given, **named)
    started = time.perf_counter()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
    textures = [texture for strands, *_ in drawn.hair for texture in strands.textures]
    megabytes = strand_textures.bytes_of(textures) / 1e6
    print(f"{gpu.platform.renderer_get()}, {gpu.platform.backend_type_get()}", end="; ")
    print(f"scene read in {time.perf_counter() - started:.2f} s: {len(drawn.hair)} heads", end=", ")
    print(f"{len(uploads)} uploads of strands, {megabytes:.0f} MB")
    size, middle = tuple(options.size), np.array([0.5 * width, 0.5 * width, 1.5])
    picture = hair_picture.HairPicture(size, 2)
    cameras = [camera_of(middle, options.distance * width, TURN * turn, size) for turn in range(FRAMES)]
    picture.add_pass(drawn, *cameras[0])  # compiles
    placed = [(batch.strands, batch.to_world, drawn.hair[batch.indices[0]][3]) for batch in drawn.batches]
    steps = level_of_detail.steps_of(placed, picture._view)
    strand_count = sum(int(np.sum(one.strand_count)) for one in steps)
    segments = sum(int(np.sum(one.strand_count * (one.point_count - 1))) for one in steps)
    print(f"{strand_count / len(drawn.hair):.0f} strands a head, {segments / 1e6:.1f} million segments a pass")
    if options.host:
        gpu.compute.dispatch = lambda *_given: None
    turning, resting = Times(not options.host), Times(not options.host)
    for camera in cameras:
        picture.restart(is_moved=True)
        turning.add(picture, drawn, camera)
    picture.restart()
    while not picture.is_fine:
        resting.add(picture, drawn, cameras[-1])
    print(f"turning: {turning}\nat rest, a pass: {resting}")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
