# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Grid in a viewport on the sample head: times of its light and of frames, and the difference to a render's
light.

.venv/bin/python tests/benchmarks/viewports/live_light.py --strands 100000 --device cuda

First of all the same is measured in a small scene, which compiles all kernels and programs; `--compile` ends there.
"""

import argparse
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
from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.render import drawn_scene, light_paths
from hair_addon.blender.render.viewport import hair_picture, live_light
from hair_addon.blender.settings import preferences
from hair_addon.core import kernels
from hair_addon.core.shading import presets

PAIRS = 30  # of frames
TURN = 0.02  # of the view from frame to frame [radians]
PAUSE = 1.0 / 60.0  # [s] after a frame at rest, in which a window leaves Python to other threads
SMALL = (2_000, (160, 100))  # strands and size of the scene that compiles

_started = time.perf_counter()


def say(text):
    """Print a line with the time since the start [s] immediately."""
    print(f"{time.perf_counter() - _started:7.1f} s  {text}", flush=True)


class View:
    """A viewport's picture of the scene, from its camera or a rotated one."""

    def __init__(self, size, per_side):
        self.size, self.per_side = size, per_side
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.camera = scene.read_camera(bpy.context.scene, depsgraph, *size)
        self.drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
        self.count = light_paths.path_count(bpy.context.scene, size)
        self.live = live_light.LiveLight()
        self._picture = hair_picture.HairPicture(size, per_side)

    def turned(self, angle):
        """Return the camera, turned around the world's Z axis."""
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        return self.camera[0] @ turn, self.camera[1]

    def draw(self, camera, is_followed=True):
        """Redraw and wait for the end; returns the lit scene and the time [s]."""
        started = time.perf_counter()
        found = self.live.lit(self.drawn, camera, self.count, time.monotonic(), is_followed)
        self._picture.restart(is_moved=True)
        self._picture.add_pass(found, *camera)
        with self._picture._sum.bind():
            self._picture._sum.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
        return found, time.perf_counter() - started

    def picture(self, drawn):
        """Return (H, W, 3) light of all passes."""
        picture = hair_picture.HairPicture(self.size, self.per_side)
        while not picture.is_fine:
            picture.add_pass(drawn, *self.camera)
        return picture.read()[..., :3]


def differences(picture, other):
    """Return (mean of pixels, mean of blocks of 12 × 12) differences, as parts of the mean light."""
    scale, side = other.mean(), 12
    change = picture - other
    height, width = (length // side * side for length in change.shape[:2])
    blocks = change[:height, :width].reshape(height // side, side, width // side, side, 3).mean(axis=(1, 3))
    return float(np.abs(change).mean() / scale), float(np.abs(blocks).mean() / scale)


def rest(view):
    """Wait at rest until all light is measured, and print times of frames; returns the lit scene."""
    started, first = time.perf_counter(), None
    kinds = {"while a share is followed": [], "that show a share, begin one, or both": []}
    waiting, showing = kinds.values()
    while not view.live.is_done:
        was_busy = view.live.is_busy
        found, seconds = view.draw(view.camera)
        (waiting if was_busy and view.live.is_busy else showing).append(seconds)
        time.sleep(PAUSE)
        if first is None and found is not view.drawn:
            first = time.perf_counter() - started
            say(f"first light of paths after {first:.2f} s, of which {live_light._REST} s at rest")
    say(f"all light after {time.perf_counter() - started:.2f} s, {view.live._paths.taken:.0f} paths")
    for name, times in kinds.items():
        if times:
            high = f"95th percentile {1e3 * np.quantile(times, 0.95):.2f}"
            say(f"{len(times)} frames {name}: median {1e3 * np.median(times):.2f} ms, {high}")
    return found


def pairs_of_frames(view, count):
    """Print the time of frames while a share is followed, each beside a frame without."""
    ratios, ended = [], 0
    for _ in range(count):
        view.live.stop()
        view.live.wait()
        _found, without = view.draw(view.camera, is_followed=False)
        view.live._is_done, view.live._acted = False, -np.inf
        view.draw(view.camera)  # begins a share
        _found, beside = view.draw(view.camera)
        ended += not view.live.is_busy
        ratios.append(beside / without)
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    say(f"{count} pairs, frame while followed / without: {middle:.3f} ({low:.3f} to {high:.3f}); {ended} shares ended")


def measure(strand_count, size, device, per_side):
    """Measure a head with a number of strands, and print the figures."""
    preferences.device = lambda: "cpu"  # hair is made on the processor
    _guides, hair = head.grow(head.build(), strand_count=strand_count)
    api.shade(hair.data, presets.PRESETS["BROWN"][1], model="MARSCHNER", mode="energy")
    head.light()
    say(f"{strand_count} strands grown")
    preferences.device = lambda: device
    view = View(size, per_side)
    say(f"scene read; {size}, {view.per_side}² samples, {gpu.platform.renderer_get()}, paths on {device}")
    for _ in range(3):  # programs are compiled
        view.draw(view.camera, is_followed=False)
    say("programs compiled")
    pairs_of_frames(view, PAIRS)
    found = rest(view)
    orbit = [view.draw(view.turned(TURN * frame))[1] for frame in range(1, PAIRS)]
    say(f"orbit: median {1e3 * np.median(orbit):.2f} ms, 95th percentile {1e3 * np.quantile(orbit, 0.95):.2f}")
    light = view.picture(found)
    paths = view.picture(light_paths.with_grid(view.drawn, *view.camera, view.count))
    for name, shown in (("dual scattering", view.picture(view.drawn)), ("the viewport", light)):
        pixels, blocks = differences(shown, paths)
        say(f"{name} against a render's light: pixels {pixels:.4f}, blocks {blocks:.4f} of the mean")
    live_light.end()


def _say_what_is_compiled():
    """Print the time that each Warp module takes to compile."""
    compile_anew = kernels.kernel_entries.compile_anew

    def timed(device, module):
        started = time.perf_counter()
        compile_anew(device, module)
        say(f"compiled {module.name.rpartition('.')[2]} for {device} in {time.perf_counter() - started:.1f} s")

    kernels.kernel_entries.compile_anew = timed


def main():
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--device", default="cpu", help="the Warp device that follows paths")
    parser.add_argument("--compile", action="store_true", help="measure the small scene only")
    options = parser.parse_args()
    wp.config.log_level = wp.LOG_WARNING
    _say_what_is_compiled()
    hair_addon.register()
    gpu.init()
    per_side = hair_picture.samples_per_side()
    say("registered; a small scene first")
    measure(*SMALL, options.device, per_side)
    if not options.compile:
        measure(options.strands, tuple(options.size), options.device, per_side)
    say("done")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
