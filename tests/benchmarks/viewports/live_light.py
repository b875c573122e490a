# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Grid in a viewport on the sample head: time to the first and to the last light, a frame's time, and the
difference to a render's light.

.venv/bin/python tests/benchmarks/viewports/live_light.py --strands 100000 --device cuda
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
from hair_addon.core.shading import presets

FRAMES = 30
TURN = 0.02  # of the view from frame to frame [radians]


class View:
    """A viewport's picture of the scene, from its camera or turned from there."""

    def __init__(self, size):
        self.size = size
        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.camera = scene.read_camera(bpy.context.scene, depsgraph, *size)
        self.drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
        self.count = light_paths.path_count(bpy.context.scene, size)
        self.live = live_light.LiveLight()
        self._picture = hair_picture.HairPicture(size, 2)

    def turned(self, angle):
        """The camera, turned around the world's Z axis."""
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        return self.camera[0] @ turn, self.camera[1]

    def draw(self, camera, is_followed=True):
        """Redraw, and wait until that is done; returns the lit scene and the time [s]."""
        started = time.perf_counter()
        found = self.live.lit(self.drawn, camera, self.count, time.monotonic(), is_followed)
        self._picture.restart(is_moved=True)
        self._picture.add_pass(found, *camera)
        self._picture._sum.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
        return found, time.perf_counter() - started

    def picture(self, drawn):
        """(H, W, 3) light of all passes."""
        picture = hair_picture.HairPicture(self.size, 2)
        while not picture.is_fine:
            picture.add_pass(drawn, *self.camera)
        return picture.read()[..., :3]


def differences(picture, other):
    """(mean of pixels, mean of blocks of 12 × 12) differences, as parts of the mean light."""
    scale, side = other.mean(), 12
    change = picture - other
    height, width = (length // side * side for length in change.shape[:2])
    blocks = change[:height, :width].reshape(height // side, side, width // side, side, 3).mean(axis=(1, 3))
    return float(np.abs(change).mean() / scale), float(np.abs(blocks).mean() / scale)


def main():
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=100_000)
    parser.add_argument("--size", type=int, nargs=2, default=[1920, 1080], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--device", default="cpu", help="the Warp device that follows paths")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    preferences.device = lambda: options.device
    _guides, hair = head.grow(head.build(), strand_count=options.strands)
    api.shade(hair.data, presets.PRESETS["BROWN"][1], model="MARSCHNER", mode="energy")
    head.light()
    view = View(tuple(options.size))
    print(f"{view.size}, {gpu.platform.renderer_get()}, paths on {options.device}, {options.strands} strands")
    for _ in range(3):  # programs are compiled
        view.draw(view.camera, is_followed=False)
    still = [view.draw(view.camera, is_followed=False)[1] for _ in range(FRAMES)]
    started, frames, first = time.perf_counter(), [], None
    while not view.live.is_done:
        found, seconds = view.draw(view.camera)
        frames.append(seconds)
        if first is None and found is not view.drawn:
            first = time.perf_counter() - started
    last = time.perf_counter() - started
    print(f"first light of paths {first:.2f} s, all {last:.2f} s, of which {live_light._REST} s at rest")
    print(f"frame [ms]: without {1e3 * np.median(still):.2f}, while followed {1e3 * np.median(frames):.2f}", end="")
    print(f", 95th percentile {1e3 * np.quantile(still, 0.95):.2f} and {1e3 * np.quantile(frames, 0.95):.2f}")
    light = view.picture(found)
    for name, other in (("dual scattering", view.drawn), ("the viewport", found)):
        paths = light_paths.with_grid(view.drawn, *view.camera, view.count)
        shown = light if other is found else view.picture(other)
        pixels, blocks = differences(shown, view.picture(paths))
        print(f"{name} against a render's light: pixels {pixels:.4f}, blocks {blocks:.4f} of the mean")
    orbit = [view.draw(view.turned(TURN * frame))[1] for frame in range(1, FRAMES)]
    print(f"orbit [ms]: {1e3 * np.median(orbit):.2f}, 95th percentile {1e3 * np.quantile(orbit, 0.95):.2f}")
    live_light.end()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
