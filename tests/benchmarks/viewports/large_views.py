# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of a viewport with many lights, pixels, strands or heads, on the sample head: milliseconds, as a table.

.venv/bin/python tests/benchmarks/viewports/large_views.py

Columns: a frame while the view turns, a pass at rest, a frame after a light was moved, and a frame after guides were
combed. Rows below have earlier times, with another camera. All lights cast shadows.
`--small` uses few strands, pixels and frames, to try the program without a GPU.
"""

import argparse
import os
import subprocess
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
from hair_addon.blender.gpu import drawing
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import hair_picture
from hair_addon.blender.settings import preferences
from tests.benchmarks.edit_guides import Editing
from tests.benchmarks.viewports.crowd import SPACE, TURN, camera_of, link_heads

FRAMES, CHANGES, STARTS = 30, 12, 3  # measured frames and changes; those before them compile and warm up
HD, UHD = (1920, 1080), (3840, 2160)
GUIDES = 1000

# {(heads, strands of each): [(lights, size)]}
CASES = {
    (1, 100_000): [(1, HD), (4, HD), (16, HD), (1, UHD), (4, UHD), (16, UHD)],
    (100, 100_000): [(1, HD), (4, HD), (16, HD), (4, UHD)],
    (1, 3_000_000): [(4, HD), (4, UHD), (16, UHD), (1, HD), (16, HD)],
    (1, 1_000_000): [(4, HD), (4, UHD)],
}
FORMER = {
    (1, 100_000, 1, HD): "9.0, moved light 37, stroke 18",
    (1, 100_000, 4, HD): "10.1, moved light 48, stroke 21.5",
    (1, 100_000, 16, HD): "12.9, moved light 55, stroke 28.7",
    (1, 1_000_000, 4, HD): "14.6",
    (1, 3_000_000, 4, HD): "24.5",
    (100, 100_000, 4, HD): "28 to 32",
}


class View:
    """A viewport's picture of a scene, seen by cameras that turn from frame to frame."""

    def __init__(self, size, cameras):
        self._picture, self._cameras, self._turn = hair_picture.HairPicture(size, 2), cameras, 0
        self._pixel = gpu.types.GPUTexture((1, 1), format="RGBA16F")
        self._end = gpu.types.GPUFrameBuffer(color_slots=self._pixel)

    def turn(self, drawn):
        """Draw a frame from the next camera."""
        self._turn += 1
        self.draw(drawn)

    def draw(self, drawn):
        """Draw a frame from the same camera, and wait for its end."""
        self._picture.restart(is_moved=True)
        self.refine(drawn)

    def refine(self, drawn):
        """Draw another pass, and wait for its end."""
        self._picture.add_pass(drawn, *self._cameras[self._turn % len(self._cameras)])
        self.wait()

    def rest(self):
        """Start a picture at rest."""
        self._picture.restart()

    @property
    def is_fine(self):
        return self._picture.is_fine

    def wait(self):
        """Wait for all previous drawing, by reading a pixel."""
        with self._end.bind():
            drawing.resolve(self._picture._color, 1)
            self._end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")


def median_of(work, count, starts=None):
    """Return the median time of a call [ms] after a few calls that compile and warm up."""
    times, starts = [], STARTS if starts is None else starts
    for _ in range(starts + count):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return float(np.median(times[starts:]))


def put_lights(count):
    """Replace all lights by a number of area lights around the head, of the same power in total; returns the first."""
    for one in [one for one in bpy.data.objects if one.type == "LIGHT"]:
        bpy.data.objects.remove(one)
    for index in range(count):
        turn, height = 2.4 * index + 0.6, 0.2 + 0.6 * (index + 0.5) / count
        ring = 1.6 * np.sqrt(1.0 - height * height)
        place = (ring * np.cos(turn), -ring * np.sin(turn), 0.7 + 1.6 * height)
        head._add_light(f"Light {index}", place, 60.0 / count, (1.0, 0.95, 0.88))
    bpy.context.view_layer.update()
    return bpy.data.objects["Light 0"]


def cameras_of(width, size):
    """Return [(world to view, view to clip)] that turn around the head, or around a crowd of a width [m]."""
    angles = TURN * np.arange(FRAMES + STARTS)
    if width:
        middle = np.array([0.5 * width, 0.5 * width, 1.5])
        return [camera_of(middle, 1.5 * width, angle, size) for angle in angles]
    depsgraph = bpy.context.evaluated_depsgraph_get()
    world_to_view, view_to_clip = scene.read_camera(bpy.context.scene, depsgraph, *size)
    found = []
    for angle in angles:
        turned = np.eye(4)
        turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        found.append((world_to_view @ turned, view_to_clip))
    return found


def measure(editing, view, lamp):
    """Return median times [ms]: turning, at rest, after a light has moved, after guides were combed."""
    drawn = editing.read()
    turning = median_of(lambda: view.turn(drawn), FRAMES)
    view.rest()
    resting = []
    while not view.is_fine:
        resting.append(median_of(lambda: view.refine(drawn), 1, starts=0))

    def move_light():
        lamp.location.x += 0.01
        bpy.context.view_layer.update()
        depsgraph, maps = bpy.context.evaluated_depsgraph_get(), drawn.shadow_maps
        lit = drawn_scene.relit(drawn, bpy.context.scene, bpy.context.view_layer, depsgraph, drawn.light, maps)
        view.draw(lit)

    moved = median_of(move_light, CHANGES)
    editing.frame = view
    editing.drawn = editing.read()
    combed = median_of(lambda: editing.once("stroke"), CHANGES)
    return turning, float(np.median(resting)), moved, combed


def gpu_memory():
    """Return the used memory of an NVIDIA GPU [MB] as text, or "?"."""
    command = ["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()[0]
    except (OSError, subprocess.CalledProcessError, IndexError):
        return "?"


def measure_scene(head_count, strand_count, cases, deadline):
    """Build heads, and print a row for each (number of lights, size) until a deadline of `time.perf_counter`."""
    started = time.perf_counter()
    guides, hair = head.grow(head.build(), guide_count=GUIDES, strand_count=strand_count)
    live_hair.write_all()
    head.light()
    width = max(link_heads(guides.data.surface, [hair], head_count), SPACE) if head_count > 1 else 0.0
    lamp = put_lights(cases[0][0])
    views = {size: View(size, cameras_of(width, size)) for _lights, size in cases}
    editing = Editing(guides, hair, next(iter(views.values())), 1.0)
    print(f"  {head_count} × {strand_count} strands: scene in {time.perf_counter() - started:.1f} s", flush=True)
    for light_count, size in cases:
        if time.perf_counter() > deadline:
            return
        lamp = put_lights(light_count)
        times = measure(editing, views[size], lamp)
        shown = "".join(f"{value:10.2f}" for value in times)
        row = f"{head_count:5} {strand_count:9} {light_count:6} {size[0]:6} × {size[1]:4}"
        former = FORMER.get((head_count, strand_count, light_count, size), "")
        print(f"{row}{shown}{gpu_memory():>9}   {former and 'before: ' + former}", flush=True)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--small", action="store_true", help="few strands, heads, pixels and frames")
    parser.add_argument("--limit", type=float, default=130.0, help="seconds after which no row begins")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    running.has_window = lambda: True  # hair is written when nobody edits it
    preferences.stroke_device = lambda: "GPU"
    print(f"{gpu.platform.renderer_get()}, {gpu.platform.backend_type_get()}, 4 samples a pixel, medians [ms]")
    print("heads   strands lights         size   turning   at rest  moved l.    stroke   GPU MB")
    cases = CASES
    if options.small:
        globals().update(FRAMES=2, CHANGES=1, STARTS=1)
        sizes = {HD: (96, 54), UHD: (192, 108)}
        cases = {
            (min(heads, 4), strands // 1000): [(lights, sizes[size]) for lights, size in rows if lights < 16]
            for (heads, strands), rows in CASES.items()
        }
    started = time.perf_counter()
    for (heads, strands), rows in cases.items():
        if time.perf_counter() < started + options.limit:
            measure_scene(heads, strands, rows, started + options.limit)
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
