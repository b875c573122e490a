# SPDX-License-Identifier: GPL-3.0-or-later
"""make turntable: the head turning under a fixed light, 24 frames as EXR with passes, rendered by the command line.

Writes head.blend, frames/head_####.exr and sheet.png to a folder. An interrupted run can be resumed.
"""

import argparse
import math
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import OpenEXR

import hair_addon
from blend_samples.heads import head, portrait
from hair_addon.blender.render import offscreen
from hair_addon.core.files.atomic_file import atomic_file

COUNT = 24
SIZE, LENS = 540, 120.0  # pixels of a side of a picture, [mm]: it holds the hair
COLUMNS, SMALLER = 6, 3  # of the sheet: pictures per row, reduction factor


def main():
    """Make everything; returns the exit status of the render command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/turntable"))
    parser.add_argument("--samples", type=int, default=16, help="samples per pixel")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    options = parser.parse_args()
    out = options.out.resolve()
    hair_addon.register()
    scene_file = out / "head.blend"
    if not scene_file.exists():  # a new file would start another sequence
        _build(scene_file)
    pattern = out / "frames" / "head_####.exr"
    words = ["render", str(scene_file), "--frames", f"1-{COUNT}", "--out", str(pattern), "--passes"]
    words += ["--samples", str(options.samples), "--jobs", str(options.jobs)]
    print("python -m hair_addon", *words, flush=True)
    root = Path(__file__).resolve().parent.parent
    status = subprocess.run([sys.executable, "-m", "hair_addon", *words], cwd=root, check=False).returncode
    if status == 0:
        bpy.ops.wm.open_mainfile(filepath=str(scene_file))
        frames = [_small(_combined(pattern.with_name(f"head_{frame:04}.exr"))) for frame in range(1, COUNT + 1)]
        rows = [np.concatenate(frames[first : first + COLUMNS], axis=1) for first in range(0, COUNT, COLUMNS)]
        offscreen.write_picture(np.concatenate(rows[::-1]), out / "sheet.png", bpy.context.scene)
        print(f"made: {out / 'sheet.png'}")
    return status


def _build(path):
    """Build the head with its hair, turning once about the vertical before a fixed camera and fixed lights."""
    skull, _guides, hair = portrait.build(portrait.AHEAD)
    portrait.make_auburn(hair.data)
    head.light()
    scene = bpy.context.scene
    # The first frame follows the last, which is one step short of a whole turn.
    for frame, turn in ((1, 0.0), (COUNT + 1, 2.0 * math.pi)):
        skull.rotation_euler.z = turn
        skull.keyframe_insert("rotation_euler", index=2, frame=frame)
    for curve in skull.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scene.frame_end, scene.render.resolution_x, scene.render.resolution_y = COUNT, SIZE, SIZE
    scene.camera.data.lens = LENS
    with atomic_file(path) as partial:
        bpy.ops.wm.save_as_mainfile(filepath=str(partial), compress=True, copy=True)


def _combined(path):
    """Read (height, width, 4) float32 of an EXR, bottom row first."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        names = [next(name for name in channels if name.endswith(f"Combined.{letter}")) for letter in "RGBA"]
        return np.stack([channels[name].pixels for name in names], axis=-1)[::-1].astype(np.float32)


def _small(pixels):
    """Return the means of squares of pixels."""
    height, width, channels = pixels.shape
    return pixels.reshape(height // SMALLER, SMALLER, width // SMALLER, SMALLER, channels).mean(axis=(1, 3))


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(status)
