# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Grid against Cycles on random scenes, by numbers of paths and weights of larger voxels.

.venv/bin/python tests/benchmarks/viewports/light_of_voxels.py --seeds 911 919 --cycles OPTIX --device cuda

Prints the error of means of 12 × 12 pixels in display levels of 255, the structural similarity, the ratio of mean
colors, and the time of the light. A variant is PATHS:PRIOR:VOXELS[:SEED]: factors of the number of paths, the weight of
larger voxels in paths (0: by the number of paths), a factor of the number of voxels, and the random seed of the paths;
"live" is the light of a viewport after one second at rest. Cycles' pictures are the means of two halves, whose
difference is its own noise.
"""

import argparse
import os
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from blend_samples.comparisons import random_scene, random_scenes
from blend_samples.sheets import picture_pairs
from hair_addon.blender.data import scene as data_scene
from hair_addon.blender.gpu import drawing
from hair_addon.blender.render import drawn_scene, film, light_paths
from hair_addon.blender.render.viewport import live_light
from hair_addon.blender.settings import preferences
from hair_addon.core.shading.light_paths import gather, strand_grid, voxel_means

VARIANTS = (
    *("1:128:1", "1:0:1", "1:32:1", "1:8:1", "4:128:1", "4:0:1", "4:32:1", "4:8:1"),
    *("16:128:1", "16:0:1", "16:8:1", "64:0:1", "64:8:8"),
)
PAUSE, MOST = 1.0 / 60.0, 20.0  # [s] after a redraw, in which a window leaves Python to other threads; at rest
_followed, _prior_of = [], voxel_means.prior_of
_started = time.perf_counter()


def say(text):
    """Print a line with the time since the start [s] immediately."""
    print(f"{time.perf_counter() - _started:6.1f} s  {text}", flush=True)


def main():
    """Render, draw, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(911, 919), metavar=("FIRST", "END"))
    parser.add_argument("--size", type=int, default=144, help="pixels along a side")
    parser.add_argument("--samples", type=int, default=1024, help="samples per pixel of each half of Cycles' pictures")
    parser.add_argument("--cycles", default="CPU", choices=("CPU", "CUDA", "OPTIX", "METAL"), help="Cycles' device")
    parser.add_argument("--device", default="cpu", help="the Warp device that follows paths")
    parser.add_argument("--variants", nargs="+", default=VARIANTS, help="PATHS:PRIOR:VOXELS[:SEED], or live")
    parser.add_argument("--limit", type=float, default=130.0, help="time [s] after which no further scene begins")
    parser.add_argument("--out", type=Path, help="write all pictures to this .npz file")
    options = parser.parse_args()
    random_scenes.prepare()
    gather.PathSums = _Followed
    random_scenes.choose_device(options.cycles)
    rows, pictures = {variant: [] for variant in options.variants}, {}
    for seed in range(*options.seeds):
        if time.perf_counter() - _started > options.limit:
            break
        preferences.device = lambda: "cpu"  # hair is made on the processor, as for all other comparisons
        random_scene.build(random_scene.recipe(seed))
        bpy.context.scene.vellus.multiple_scattering = "GRID"
        halves = [by_cycles(options, half) for half in range(2)]
        reference = 0.5 * (halves[0] + halves[1])
        if np.isnan(picture_pairs.block_error(reference, reference)):
            say(f"{seed}: no block of hair")
            continue
        noise = picture_pairs.block_error(*halves), picture_pairs.structure(*halves)
        say(f"{seed}: halves of Cycles: blocks {noise[0]:.2f}, structure {noise[1]:.3f}")
        pictures[f"{seed} cycles"] = reference.astype(np.float16)
        preferences.device = lambda: options.device
        for variant in options.variants:
            picture, seconds, variance, taken = by_vellus(variant, options)
            blocks, structure = (
                measure(reference, picture) for measure in (picture_pairs.block_error, picture_pairs.structure)
            )
            rows[variant].append((blocks, structure, seconds, picture_pairs.deviation(reference, picture)))
            ratio = " ".join(f"{value:.3f}" for value in picture_pairs.ratio(reference, picture))
            say(
                f"{seed} {variant:9} blocks {blocks:5.2f}  structure {structure:.3f}  ratio {ratio}  {seconds:.2f} s  "
                f"{taken:.0f} paths, relative variance {variance:.1f}"
            )
            pictures[f"{seed} {variant}"] = picture.astype(np.float16)
    for variant, found in rows.items():
        blocks, structures, seconds, deviations = np.array(found or [(np.nan,) * 4]).T
        say(
            f"{variant:9} {len(found)} scenes: blocks mean {blocks.mean():.2f}, worst {blocks.max():.2f}; structure "
            f"mean {structures.mean():.3f}, worst {structures.min():.3f}; color off by {np.median(deviations):.1%} in "
            f"the median, {deviations.max():.1%} at worst; light {np.median(seconds):.2f} s"
        )
    if options.out is not None:
        np.savez_compressed(options.out, **pictures)


def by_cycles(options, half):
    """Return (H, W, 4) linear premultiplied pixels of the scene by Cycles, with other random numbers for each half."""
    path = Path(bpy.app.tempdir) / f"half_{half}.exr"
    return random_scenes.path_traced(path, SimpleNamespace(**vars(options) | {"device": options.cycles}), 1 + half)


def by_vellus(variant, options):
    """Return (pixels as of `random_scenes.by_vellus`, time of the light [s], variance of a path's light relative to the
    square of its mean, number of paths) with the settings of a variant.
    """
    blender_scene, depsgraph = bpy.context.scene, data_scene.present_depsgraph()
    size = (options.size, options.size)
    camera = data_scene.read_camera(blender_scene, depsgraph, *size)
    drawn = drawn_scene.read(blender_scene, bpy.context.view_layer, depsgraph)
    count = light_paths.path_count(blender_scene, size)
    lit, seconds = at_rest(drawn, camera, count) if variant == "live" else traced(drawn, camera, count, variant)
    light = _followed[-1] if _followed else None
    variance, taken = (0.0, 0) if light is None else (light.wanted * gather._KNOWN**2 * light.taken, light.taken)
    picture = film.Film(size, 4, ("Combined",), True, 2.0 * blender_scene.render.filter_size)
    for turn in range(blender_scene.vellus.sample_count // 16):
        with drawing.ALONE:
            picture.add_pass(lit, *camera, size, turn)
    return picture.read()["Combined"], seconds, variance, taken


def at_rest(drawn, camera, count):
    """Return (scene as a viewport shows it after one second at rest, time [s] until all paths are traced)."""
    voxel_means.prior_of = _prior_of
    live, started, found = live_light.LiveLight(), time.perf_counter(), None
    while not live.is_done or found is None:
        lit = live.lit(drawn, camera, count, time.monotonic())
        time.sleep(PAUSE)
        seconds = time.perf_counter() - started
        found = lit if found is None and (live.is_done or seconds > live_light._REST + 1.0) else found
        if seconds > MOST:
            break
    live.stop()
    live.wait()
    return found, seconds


def traced(drawn, camera, count, variant):
    """Return (scene lit by paths with the settings of a variant, time [s])."""
    factor, prior, voxels, seed = map(float, f"{variant}:0".split(":")[:4])
    voxel_means.prior_of = (lambda _paths: prior) if prior else _prior_of
    default_voxels, most_voxels = strand_grid.build.__defaults__, strand_grid.MOST_VOXELS
    strand_grid.build.__defaults__ = default_voxels[0], int(voxels * default_voxels[1]), *default_voxels[2:]
    strand_grid.MOST_VOXELS = int(np.ceil(voxels ** (1.0 / 3.0)) * most_voxels)
    started = time.perf_counter()
    try:
        lit = light_paths.with_grid(drawn, *camera, int(factor * count), int(seed))
    finally:
        strand_grid.build.__defaults__, strand_grid.MOST_VOXELS = default_voxels, most_voxels
    return lit, time.perf_counter() - started


class _Followed(gather.PathSums):
    """`PathSums` that the benchmark remembers."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        _followed[:] = [self]


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
