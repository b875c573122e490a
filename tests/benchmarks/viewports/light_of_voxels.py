# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Grid against Cycles on random scenes, by numbers of paths and weights of larger voxels.

.venv/bin/python tests/benchmarks/viewports/light_of_voxels.py --seeds 911 919 --cycles OPTIX --device cuda

Prints the error of means of 12 × 12 pixels in display levels of 255, the structural similarity, the ratio of mean
colors, and the time of the light. A variant is PATHS:PRIOR:VOXELS[:SEED]: factors of the number of paths, the weight of
larger voxels in paths (0: by the number of paths), a factor of the number of voxels, and the random seed of the paths;
"live" is the light of a viewport after one second at rest, "voxels" the same without sample points along strands.
Cycles' pictures are the means of two halves, whose difference is its own noise; errors are also estimated without it.

With --references, many processes share Cycles' work: some with --references-only, each on one thread, render halves
that no other process has begun, and one process draws all scenes meanwhile, then compares them with the halves.
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
from hair_addon.core.shading.light_paths import gather, strand_grid, strand_nodes, voxel_means

VARIANTS = (
    *("1:128:1", "1:0:1", "1:32:1", "1:8:1", "4:128:1", "4:0:1", "4:32:1", "4:8:1"),
    *("16:128:1", "16:0:1", "16:8:1", "64:0:1", "64:8:8"),
)
PAUSE, MOST = 1.0 / 60.0, 20.0  # [s] after a redraw, in which a window leaves Python to other threads; at rest
_followed, _prior_of = [], voxel_means.prior_of
_waiting = {}  # seed → {variant: `by_vellus`} of drawn scenes that are not compared yet
_started = time.perf_counter()


def say(text):
    """Print a line with the time since the start [s] immediately."""
    print(f"{time.perf_counter() - _started:6.1f} s  {text}", flush=True)


def main():
    """Render, draw, and print the figures."""
    options = _options()
    random_scenes.prepare()
    random_scenes.choose_device(options.cycles)
    if options.references_only:
        render_references(options)
        return
    gather.PathSums = _Followed
    rows, pictures = {variant: [] for variant in options.variants}, {}
    if options.device != "cpu":  # compiled kernels take no part in the first scene's second
        build(options.seeds[0])
        preferences.device = lambda: options.device
        by_vellus("1:0:1", options)
    for seed in range(*options.seeds):
        if time.perf_counter() - _started > options.limit:
            break
        build(seed)
        halves = None if options.references else [by_cycles(options, half) for half in range(2)]
        preferences.device = lambda: options.device
        drawn = {variant: by_vellus(variant, options) for variant in options.variants}
        pictures |= {f"{seed} {variant}": picture.astype(np.float16) for variant, (picture, *_) in drawn.items()}
        _waiting[seed] = drawn
        if halves is not None:
            compare(seed, halves, rows, pictures)
    while _waiting and time.perf_counter() < _started + options.patience:
        for seed in list(_waiting):
            paths = [options.references / f"{seed}_{half}.npy" for half in range(2)]
            if all(path.is_file() for path in paths):
                compare(seed, [np.load(path).astype(np.float32) for path in paths], rows, pictures)
        time.sleep(PAUSE)
    say(f"{len(_waiting)} scenes lack references")
    report(rows)
    if options.out is not None:
        np.savez_compressed(options.out, **pictures)


def _options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(911, 919), metavar=("FIRST", "END"))
    parser.add_argument("--size", type=int, default=144, help="pixels along a side")
    parser.add_argument("--samples", type=int, default=1024, help="samples per pixel of each half of Cycles' pictures")
    parser.add_argument("--cycles", default="CPU", choices=("CPU", "CUDA", "OPTIX", "METAL"), help="Cycles' device")
    parser.add_argument("--device", default="cpu", help="the Warp device that follows paths")
    parser.add_argument("--variants", nargs="+", default=VARIANTS, help="PATHS:PRIOR:VOXELS[:SEED], live, or voxels")
    parser.add_argument("--limit", type=float, default=130.0, help="time [s] after which no further scene begins")
    parser.add_argument("--out", type=Path, help="write all pictures to this .npz file")
    parser.add_argument("--references", type=Path, help="folder of Cycles' halves, which other processes fill")
    parser.add_argument("--references-only", action="store_true", help="fill that folder, on one thread")
    parser.add_argument("--patience", type=float, default=380.0, help="time [s] until which references are awaited")
    options = parser.parse_args()
    if options.references is not None:
        options.references.mkdir(parents=True, exist_ok=True)
    return options


def build(seed):
    """Make a random scene; its hair is made on the processor, as for all other comparisons."""
    preferences.device = lambda: "cpu"
    random_scene.build(random_scene.recipe(seed))
    bpy.context.scene.vellus.multiple_scattering = "GRID"


def render_references(options):
    """Render the halves of Cycles' pictures that no other process has begun."""
    for seed in range(*options.seeds):
        is_built = False
        for half in range(2):
            path = options.references / f"{seed}_{half}.npy"
            if time.perf_counter() - _started > options.limit or path.is_file():
                continue
            try:
                path.with_suffix(".begun").touch(exist_ok=False)
            except FileExistsError:
                continue
            if not is_built:
                build(seed)
                is_built = True
            bpy.context.scene.render.threads_mode, bpy.context.scene.render.threads = "FIXED", 1
            pixels = by_cycles(options, half)
            np.save(path.with_suffix(".part.npy"), pixels.astype(np.float16))
            path.with_suffix(".part.npy").rename(path)


def compare(seed, halves, rows, pictures):
    """Print the figures of a scene that is drawn, and add them to the rows of variants."""
    drawn, reference = _waiting.pop(seed), 0.5 * (halves[0] + halves[1])
    if np.isnan(picture_pairs.block_error(reference, reference)):
        say(f"{seed}: no block of hair")
        return
    noise = picture_pairs.block_error(*halves), picture_pairs.structure(*halves)
    say(f"{seed}: halves of Cycles: blocks {noise[0]:.2f}, structure {noise[1]:.3f}")
    pictures[f"{seed} cycles"] = reference.astype(np.float16)
    for variant, (picture, seconds, variance, taken) in drawn.items():
        blocks, structure = (
            measure(reference, picture) for measure in (picture_pairs.block_error, picture_pairs.structure)
        )
        deviation = picture_pairs.deviation(reference, picture)
        noiseless = picture_pairs.noiseless_block_error(halves, picture)
        rows[variant].append((blocks, structure, seconds, deviation, noiseless))
        ratio = " ".join(f"{value:.3f}" for value in picture_pairs.ratio(reference, picture))
        say(
            f"{seed} {variant:9} blocks {blocks:5.2f}, noiseless {noiseless:5.2f}  structure {structure:.3f}  "
            f"ratio {ratio}  {seconds:.2f} s  {taken:.0f} paths, relative variance {variance:.1f}"
        )


def report(rows):
    """Print the distribution of the figures of each variant."""
    for variant, found in rows.items():
        blocks, structures, seconds, deviations, noiseless = np.array(found or [(np.nan,) * 5]).T
        say(
            f"{variant:9} {len(found)} scenes: within 8 % {np.mean(deviations < 0.08):.0%}, within 15 % "
            f"{np.mean(deviations < 0.15):.0%}, median {np.median(deviations):.1%}, worst {deviations.max():.1%}; "
            f"blocks mean {blocks.mean():.2f}, worst {blocks.max():.2f}, noiseless {noiseless.mean():.2f}; "
            f"structure mean {structures.mean():.3f}, worst {structures.min():.3f}; light {np.median(seconds):.2f} s"
        )


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
    is_live, most = variant in ("live", "voxels"), strand_nodes._MOST_NODES
    strand_nodes._MOST_NODES = 0 if variant == "voxels" else most
    try:
        lit, seconds = at_rest(drawn, camera, count) if is_live else traced(drawn, camera, count, variant)
    finally:
        strand_nodes._MOST_NODES = most
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
