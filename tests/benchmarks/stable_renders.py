# SPDX-License-Identifier: GPL-3.0-or-later
"""Flicker of rendered hair while the scene rotates under fixed lights, by dual scattering and by Light Grid.

Scenes of `random_scene` turn by a quarter of a degree with each frame. The script prints differences of hair pixels in
display levels of 255: the 99th percentile of the change of pixels between frames; the mean and the 99th percentile of
the change of means over 12 × 12 pixels, which show flicker that single pixels hide; the same with `--converged` times
as many paths; and the root mean square difference of these blocks between both.

.venv/bin/python tests/benchmarks/stable_renders.py --seeds 36 45 41 --converged 16
"""

import argparse
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from blend_samples.comparisons import random_scene, random_scenes
from hair_addon import api
from hair_addon.blender.gpu import display_transform
from hair_addon.blender.render import light_paths

BLOCK = 12  # pixels along each side


def levels(picture):
    """Convert premultiplied light (H, W, 4) to display values (H, W, 3) of the scene's view transform, from 0 to
    255.
    """
    transform = display_transform.DisplayTransform.of(bpy.context.scene)
    shown = display_transform.apply(transform, np.ascontiguousarray(picture[..., :3], np.float32).reshape(-1, 3))
    return 255.0 * np.clip(shown, 0.0, 1.0).reshape(*picture.shape[:2], 3)


def block_means(values):
    """Return the means of blocks: (H, W, C) → (H / 12, W / 12, C)."""
    height, width = (length // BLOCK for length in values.shape[:2])
    cut = values[: height * BLOCK, : width * BLOCK].reshape(height, BLOCK, width, BLOCK, -1)
    return cut.mean(axis=(1, 3))


def frames(options, scattering, times=1):
    """Return (frames, H, W, 4) of a scene that turns, and the processor seconds per frame."""
    blender_scene = bpy.context.scene
    blender_scene.vellus.multiple_scattering = scattering
    kept = light_paths._PATHS_A_PIXEL, light_paths._LEAST_PATHS, light_paths._MOST_PATHS
    names = ("_PATHS_A_PIXEL", "_LEAST_PATHS", "_MOST_PATHS")
    for name, value in zip(names, kept, strict=True):
        setattr(light_paths, name, value * times)
    kind = "CAMERA" if options.camera else "MESH"
    turned = [placed for placed in bpy.data.objects if placed.parent is None and placed.type == kind]
    starts = [placed.matrix_world.copy() for placed in turned]
    found, started = [], time.process_time()
    for frame in range(options.frames):
        for placed, start in zip(turned, starts, strict=True):
            placed.matrix_world = Matrix.Rotation(np.radians(0.25 * frame), 4, "Z") @ start
        bpy.context.view_layer.update()
        found.append(
            api.draw(width=options.size, height=options.size, samples_per_side=options.per_side, is_transparent=True)
        )
    for placed, start in zip(turned, starts, strict=True):
        placed.matrix_world = start
    bpy.context.view_layer.update()
    for name, value in zip(names, kept, strict=True):
        setattr(light_paths, name, value)
    return np.stack(found), (time.process_time() - started) / options.frames


def report(seed, name, pictures, seconds, converged=None):
    """Print a row of figures."""
    pixels = np.stack([levels(picture) for picture in pictures])
    shown = [block_means(picture) for picture in pixels]
    coverage = pictures.mean(axis=0)[..., 3:]
    is_hair = block_means(coverage)[..., 0] > 0.25
    change = np.abs(np.diff(shown, axis=0)).max(axis=-1)[:, is_hair]
    single = np.abs(np.diff(pixels, axis=0)).max(axis=-1)[:, coverage[..., 0] > 0.0]
    error = ""
    if converged is not None:
        still = [block_means(levels(picture)) for picture in converged]
        off = np.sqrt(np.mean(np.square(np.array(shown) - still).max(axis=-1)[:, is_hair]))
        error = f", error {off:5.2f}"
    print(
        f"{seed:4} {name:16} pixels change 99 % {np.quantile(single, 0.99):6.2f}; "
        f"blocks {change.mean():5.2f}, 99 % {np.quantile(change, 0.99):6.2f}{error}; "
        f"{seconds:6.2f} s of processor time",
        flush=True,
    )


def main():
    """Print rows of each scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[36, 45, 41])
    parser.add_argument("--size", type=int, default=360, help="pixels along a side")
    parser.add_argument("--per-side", type=int, default=4, help="samples along each side of a pixel")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--camera", action="store_true", help="the camera turns, not body and hair")
    parser.add_argument("--converged", type=int, default=0, help="so many times the paths, for comparison")
    options = parser.parse_args()
    random_scenes.prepare()
    for seed in options.seeds:
        random_scene.build(random_scene.recipe(seed))
        converged = None
        report(seed, "dual scattering", *frames(options, "DUAL"))
        if options.converged:
            converged, seconds = frames(options, "GRID", options.converged)
            report(seed, f"{options.converged} × the paths", converged, seconds)
        report(seed, "light grid", *frames(options, "GRID"), converged)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
