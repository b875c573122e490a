# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes drawn at random, by Cycles and by Vellus: python blend_samples/comparisons/random_scenes.py --seeds 0 30.

Prints each scene with the ratio of its hair's mean color (Vellus / Cycles, channel by channel), the structural
similarity, and the error of the means of 12 × 12 pixels in display levels of 255, then the distribution; writes
worst.png, the ten worst pairs with Cycles above Vellus, scenes.json, and distribution.png, the part of the scenes up to
each deviation, with --dual beside that of a scenes.json by dual scattering. Cycles' pictures are kept in --references
with the extent of their hair: another run, on any machine, renders only what changed. --references-only renders them
and nothing else, so that processes can share the seeds; with --pictures they can share those of Vellus too.
"""

import argparse
import hashlib
import json
import math
import os
import sys
import time
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.comparisons import random_scene
from blend_samples.sheets import line_plot, picture_pairs
from hair_addon import api
from hair_addon.blender.data import scene as data_scene
from hair_addon.blender.gpu import drawing
from hair_addon.blender.render import drawn_scene, film, light_paths

_VERSION = 2  # of how references are rendered
_SAME_HAIR = 2e-4  # [m] that processors may differ in the mean and the spread of the same hair's points


def main():
    """Render, draw, measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/random_scenes"))
    parser.add_argument("--references", type=Path, help="folder of Cycles' pictures; OUT/cycles without it")
    parser.add_argument("--references-only", action="store_true", help="render missing references, measure nothing")
    parser.add_argument("--pictures", type=Path, help="folder of Vellus' pictures: only those that it lacks are drawn")
    parser.add_argument("--seeds", type=int, nargs="+", default=(0, 30), help="FIRST END, and any number of such pairs")
    parser.add_argument("--size", type=int, default=144, help="pixels along a side")
    parser.add_argument("--samples", type=int, default=48, help="samples a pixel, of Cycles")
    parser.add_argument("--device", default="CPU", choices=("CPU", "CUDA", "OPTIX", "METAL"), help="of Cycles")
    parser.add_argument("--scattering", default="GRID", choices=("GRID", "DUAL"), help="of the scene's render settings")
    parser.add_argument("--dual", type=Path, help="scenes.json of a run with --scattering DUAL, for the plot")
    options = parser.parse_args()
    options.references = options.references or options.out / "cycles"
    for folder in filter(None, (options.out, options.references, options.pictures)):
        folder.mkdir(parents=True, exist_ok=True)
    prepare()
    choose_device(options.device)
    rows, pairs = [], []
    ranges = zip(options.seeds[::2], options.seeds[1::2], strict=True)
    for seed in (seed for first, end in ranges for seed in range(first, end)):
        values = random_scene.recipe(seed)
        curves = random_scene.build(values)
        bpy.context.scene.vellus.multiple_scattering = options.scattering
        reference = by_cycles(values, curves, options)
        if options.references_only:
            print(f"{seed:4}  reference", flush=True)
            continue
        if not reference[..., 3].any():
            print(f"{seed:4}  no hair is in view", flush=True)
            continue
        started = time.process_time()
        picture = kept_or_drawn(seed, options)
        row = {
            "scene": values,
            "ratio": picture_pairs.ratio(reference, picture).round(4).tolist(),
            "deviation": picture_pairs.deviation(reference, picture),
            "structure": picture_pairs.structure(reference, picture),
            "blocks": picture_pairs.block_error(reference, picture),
            "coverage": float(picture[..., 3].sum() / reference[..., 3].sum()),
            "cycles": picture_pairs.mean(reference).round(5).tolist(),
            "seconds": time.process_time() - started,
        }
        print(line(row), flush=True)
        rows.append(row)
        pairs.append((f"{seed}: " + " ".join(f"{value:.2f}" for value in row["ratio"]), reference, picture))
    if options.references_only:
        return
    (options.out / "scenes.json").write_text(json.dumps(rows, indent=1))
    print(summary(rows))
    dual = [] if options.dual is None else json.loads(options.dual.read_text())
    own = "light grid" if options.scattering == "GRID" else "now"
    write_distribution({own: rows, "dual scattering": dual}, options.out / "distribution.png")
    worst = sorted(zip(rows, pairs, strict=True), key=lambda both: -both[0]["deviation"])[:10]
    picture_pairs.write_sheet([pair for _row, pair in worst], options.out / "worst.png")


def prepare():
    """Start Vellus and the graphics context."""
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING


def choose_device(name):
    """Let Cycles render on all devices of a kind; on the processor if there are none."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    if name != "CPU":
        preferences.compute_device_type = name
        preferences.refresh_devices()
        for device in preferences.devices:
            device.use = device.type == name


def by_cycles(values, curves, options):
    """Return (H, W, 4) linear premultiplied pixels of the hair, path traced, or kept from an earlier run."""
    path = options.references / f"{values['seed']}_{key(values, options)}.npy"
    extent = hair_extent(curves)
    kept = path.with_suffix(".json")
    if path.is_file() and kept.is_file():
        distance = between(json.loads(kept.read_text()), extent)
        if distance < _SAME_HAIR:
            return np.load(path)
        print(f"{values['seed']:4}  rendering again: the kept reference's hair differs by {distance:.2g} m", flush=True)
    pixels = path_traced(path.with_suffix(".exr"), options)
    np.save(path, pixels)
    kept.write_text(json.dumps(extent))
    return pixels


def path_traced(path, options, seed=1):
    """Return (H, W, 4) linear premultiplied pixels of the scene by Cycles; path: of a file that is deleted again."""
    blender_scene = bpy.context.scene
    render, cycles = blender_scene.render, blender_scene.cycles
    render.engine, render.film_transparent = "CYCLES", True
    render.resolution_x = render.resolution_y = options.size
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGBA", "32"
    cycles.device = "CPU" if options.device == "CPU" else "GPU"
    cycles.samples, cycles.seed = options.samples, seed
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = 0.0
    cycles.blur_glossy = 0.0  # Filter Glossy would make hair rougher after the first bounce
    render.filepath = str(path.resolve())
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath, check_existing=False)
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    Path(render.filepath).unlink()
    return pixels.reshape(options.size, options.size, 4)


def key(values, options):
    """Return a key of a reference: the scene's values and the sampling."""
    return hashlib.sha256(json.dumps([_VERSION, values, options.size, options.samples]).encode()).hexdigest()[:16]


def hair_extent(curves):
    """Return the number, mean and spread along X, Y, Z [m] of the points of each hair, as plain values."""
    found = [api.points(hair).reshape(-1, 3).astype(np.float64) for hair in curves]
    return [[len(points), points.mean(axis=0).tolist(), points.std(axis=0).tolist()] for points in found]


def between(first, second):
    """Return the largest difference of two extents in a mean or a spread [m]; infinite for other numbers of points."""
    if [one[0] for one in first] != [one[0] for one in second]:
        return math.inf
    return max(float(np.abs(np.subtract(one[1:], other[1:])).max()) for one, other in zip(first, second, strict=True))


def kept_or_drawn(seed, options):
    """`by_vellus`, or what an earlier run with the same --pictures has drawn."""
    if options.pictures is None:
        return by_vellus(options.size)
    path = options.pictures / f"{seed}_{options.scattering.lower()}_{options.size}.npy"
    if not path.is_file():
        np.save(path, by_vellus(options.size))
    return np.load(path)


def by_vellus(size):
    """Return (H, W, 4) linear premultiplied pixels of the hair, with the samples and the filter of a render."""
    blender_scene, depsgraph = bpy.context.scene, data_scene.present_depsgraph()
    camera = data_scene.read_camera(blender_scene, depsgraph, size, size)
    drawn = drawn_scene.read(blender_scene, bpy.context.view_layer, depsgraph)
    drawn = light_paths.with_grid(drawn, *camera, light_paths.path_count(blender_scene, (size, size)))
    picture = film.Film((size, size), 4, ("Combined",), True, 2.0 * blender_scene.render.filter_size)
    for turn in range(blender_scene.vellus.sample_count // 16):
        with drawing.ALONE:
            picture.add_pass(drawn, *camera, (size, size), turn)
    return picture.read()["Combined"]


def line(row):
    """Return a scene in one line."""
    values = row["scene"]
    hair = ", ".join(
        " ".join(
            [
                *(one["area"], one["look"].lower()),
                *(f"{one['length']:.2f} m", f"{one['strand_count'] // 1000}k"),
                *one["styles"],
            ]
        ).strip()
        for one in values["hair"]
    )
    lights = " ".join(light["kind"].lower() for light in values["lights"]) or "no light"
    ratios = " ".join(f"{value:5.2f}" for value in row["ratio"])
    return (
        f"{values['seed']:4}  {ratios}  structure {row['structure']:.3f}  blocks {row['blocks']:5.2f}  "
        f"{values['body']}: {hair}; {lights}, {values['world']['kind']} world"
    )


def summary(rows):
    """Return the distribution of the largest deviations in a channel."""
    deviations = np.array([row["deviation"] for row in rows])
    structures, blocks = (np.array([row[name] for row in rows]) for name in ("structure", "blocks"))
    return (
        f"{len(rows)} scenes: within 8 % {np.mean(deviations < 0.08):.0%}, "
        f"within 15 % {np.mean(deviations < 0.15):.0%}, "
        f"median {np.median(deviations):.1%}, worst {deviations.max():.0%}; "
        f"structure median {np.median(structures):.3f}, worst {structures.min():.3f}; "
        f"blocks median {np.nanmedian(blocks):.2f}, worst {np.nanmax(blocks):.2f}"
    )


def write_distribution(runs, path):
    """Plot the part of the scenes whose largest deviation in a channel is up to a value; runs: {label: rows}."""
    ticks = (0, 8, 15, 25, 50, 75, 100, 125), (0, 25, 50, 75, 100)
    words = "% of scenes up to a deviation", (0, 130), (0, 102), ticks, "% of Cycles, in the worst channel"
    plot = line_plot.Plot(*words, size=(560, 260), legend=(0.75, 0.75))
    for (label, rows), color in zip(runs.items(), line_plot.COLORS[1::-1], strict=True):
        if rows:
            deviations = np.sort([100.0 * row["deviation"] for row in rows])
            parts = np.linspace(0.0, 100.0, len(rows) + 1)
            steps = np.stack([np.repeat(deviations, 2), np.repeat(parts, 2)[1:-1]], axis=-1)
            plot.line([(0.0, 0.0), (deviations[0], 0.0), *steps, (130.0, 100.0)], color)
            plot.name(color, label)
    line_plot.write([plot], path)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
