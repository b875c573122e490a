# SPDX-License-Identifier: GPL-3.0-or-later
"""make pictures: every picture of README and manual, by the script that draws it; ARGS="styles grooms" for some.

Each script runs in a process of its own, --jobs of them at a time, and its pictures come to docs/ when it ends well.
Those that take many minutes on two cores, or Blender's window, are drawn only where they are named: `SLOW`.
Cycles' pictures of random scenes, of which docs/scenes.png is made, take hours: see comparisons/random_scenes.py.
"""

import argparse
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "pictures"

# Name → script and its arguments. OUT is a folder of its own, from which `COPIED` is taken.
SCRIPTS = {
    "demo": "blend_samples/demo.py --out OUT",
    "compare": "blend_samples/comparisons/compare.py --out OUT --cycles-samples 48",
    "turntable": "blend_samples/turntable.py --out OUT",
    "grooms": "blend_samples/library/ten_grooms.py",
    "styles": "blend_samples/pictures/styles.py",
    "composite": "blend_samples/pictures/composite.py --out OUT",
    "composite_engines": "blend_samples/pictures/composite_engines.py --out OUT",
    "cryptomatte": "blend_samples/pictures/cryptomatte_picture.py",
    "transfer": "blend_samples/pictures/transfer_picture.py",
    "style_pictures": "blend_samples/pictures/style_pictures.py",
    "guide_tools": "blend_samples/pictures/guide_tool_pictures.py",
    "gather": "blend_samples/pictures/gather_pictures.py",
    "use_as_hair": "blend_samples/pictures/use_as_hair_pictures.py",
    "mesh_to_hair": "blend_samples/pictures/mesh_to_hair_pictures.py",
    "placements": "blend_samples/comparisons/placements.py",
    "parting": "blend_samples/comparisons/parting.py",
    "clump": "blend_samples/comparisons/clump_beside_blender.py",
    "data_flow": "blend_samples/pictures/data_flow.py",
    "looks": "blend_samples/pictures/look_pictures.py",
    "style_presets": "blend_samples/pictures/style_preset_pictures.py",
    "dynamics_settings": "blend_samples/dynamics/dynamics_setting_pictures.py",
}
SLOW = {
    "cycles": "blend_samples/demo.py --out OUT --only-cycles --cycles-samples 128",
    "cards": "blend_samples/pictures/cards.py",
    "haircuts": "blend_samples/pictures/haircut_pictures.py",
    "quick_fur": "blend_samples/comparisons/quick_fur.py",
    "maps": "blend_samples/pictures/map_pictures.py",
    "dynamics": "blend_samples/dynamics/dynamics.py shaking wind ball --out OUT --docs docs",
    "five_minutes": "tools/manual_pictures.py five_minutes",
    "curly_hair": "tools/manual_pictures.py curly_hair",
    "shading_modes": "tools/manual_pictures.py shading_modes",
    "film_strip": "tools/manual_pictures.py film_strip",
    "panels": "tools/manual_pictures.py",
}

# Name → {file that it leaves in OUT: picture of docs/}.
COPIED = {
    "demo": {f"{name}.png": f"{name}.png" for name in ("kajiya_kay", "marschner", "dual_scattering", "styled")},
    "cycles": {"cycles.png": "dual_scattering_cycles.png"},
    "compare": {"compare.png": "compare.png"},
    "turntable": {"sheet.png": "turntable.png"},
    "composite": {"composite.png": "composite.png", "passes.png": "passes.png"},
    "composite_engines": {"composite.png": "manual/composite.png"},
}

# Name → the pictures of docs/ that it draws beside those.
OTHERS = {
    "grooms": ("grooms.png", "manual/groom_library.png"),
    "styles": ("styles.png", "wet.png"),
    "cryptomatte": ("manual/cryptomatte.png",),
    "transfer": ("transfer.png", "manual/transfer_groom.png"),
    "style_pictures": ("manual/style_*.png",),
    "guide_tools": ("manual/guide_tools.png",),
    "gather": ("manual/gather.png",),
    "use_as_hair": ("manual/use_as_hair.png",),
    "mesh_to_hair": ("manual/mesh_to_hair.png",),
    "placements": ("guide_placement.png",),
    "parting": ("parting.png",),
    "clump": ("clump_beside_blender.png",),
    "data_flow": ("data_flow.svg",),
    "dynamics_settings": ("manual/dynamics_*.png",),
    "cards": ("manual/cards.jpg",),
    "haircuts": ("manual/haircuts*.jpg",),
    "quick_fur": ("manual/quick_fur.jpg",),
    "maps": ("manual/maps.jpg", "manual/more_maps.jpg", "manual/wet_map.jpg"),
    "dynamics": ("dynamics_*.png",),
    "five_minutes": ("five_minutes/*.png",),
    "curly_hair": ("manual/curly_*.png",),
    "shading_modes": ("manual/shading_modes.jpg",),
    "film_strip": ("manual/film_strip.jpg",),
    "panels": tuple(
        f"manual/{name}.png"
        for name in (
            *("systems", "surface", "guides", "strands", "dynamics", "styles", "shading", "lookup_tables", "output"),
            *("hair", "looks", "redo", "rendering", "use_as_guides"),
        )
    ),
}
ELSEWHERE = ("scenes.png", "scenes_worst.png")


def main():
    """Draw the requested pictures; the exit status is 0 only if all were drawn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = f"of {', '.join(SCRIPTS)}, all by default; and {', '.join(SLOW)}"
    parser.add_argument("names", nargs="*", help=known)
    parser.add_argument("--jobs", type=int, default=1, help="scripts that run at a time")
    given = parser.parse_args()
    if unknown := set(given.names) - set(SCRIPTS | SLOW):
        parser.error(f"there is no {', '.join(sorted(unknown))}")
    with ThreadPoolExecutor(given.jobs) as pool:
        statuses = list(pool.map(draw, given.names or SCRIPTS))
    return max(statuses, key=abs)


def draw(name):
    """Run a script and copy its pictures; returns the exit status, 0 if all were drawn."""
    out = OUT / name
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    words = [str(out) if word == "OUT" else word for word in (SCRIPTS | SLOW)[name].split()]
    started = time.perf_counter()
    with open(out / "log.txt", "wb") as log:
        run = [sys.executable, *words]
        status = subprocess.run(run, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT, check=False).returncode
    if status == 0:
        for source, picture in COPIED.get(name, {}).items():
            shutil.copyfile(out / source, ROOT / "docs" / picture)
    note = "drawn" if status == 0 else f"status {status}, see {out / 'log.txt'}"
    print(f"{name}: {note}, {time.perf_counter() - started:.0f} s", flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
