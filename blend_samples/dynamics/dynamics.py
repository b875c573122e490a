# SPDX-License-Identifier: GPL-3.0-or-later
"""make dynamics: strips of moving hair, plots of its solver, and a film by the command line, in out/dynamics.

`python blend_samples/dynamics/dynamics.py shaking plots` makes some of them. Each strip comes with its figures.
"""

import argparse
import os
import sys
import time
from pathlib import Path

import bpy
import gpu
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.dynamics import dynamics_film, dynamics_plots, dynamics_scene, dynamics_strips


def main():
    """Make the requested pictures, all by default; the exit status is 0 only if all were made."""
    made = {**dynamics_strips.STRIPS, "plots": None, "film": None}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(made)}; all by default")
    parser.add_argument("--out", type=Path, default=Path("out/dynamics"))
    parser.add_argument("--strands", type=int, default=dynamics_scene.STRAND_COUNT, help="number of strands")
    parser.add_argument("--docs", type=Path, help="folder for smaller copies of the strips: docs/dynamics_STRIP.png")
    given = parser.parse_args()
    unknown = set(given.names) - set(made)
    if unknown:
        parser.error(f"there is no {', '.join(sorted(unknown))}")
    names, out = given.names or list(made), given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    started = time.perf_counter()
    if "plots" in names:
        dynamics_plots.draw(out)
    if set(names) != {"plots"}:
        dynamics_scene.build(given.strands)
        scene_file = out / "head.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=True)
        for name, strip in dynamics_strips.STRIPS.items():
            if name in names:
                dynamics_strips.draw(name, strip, scene_file, out)
                if given.docs is not None:
                    dynamics_strips.write_page(out / f"{name}.png", given.docs.resolve() / f"dynamics_{name}.png")
    status = dynamics_film.make(scene_file, out) if "film" in names else 0
    print(f"made in {time.perf_counter() - started:.0f} s: {out}")
    return status


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(status)
