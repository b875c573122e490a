# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/haircuts.jpg and haircuts_cycles.jpg: haircuts that tests/desktop/haircuts makes in Blender's window.

    python blend_samples/pictures/haircut_pictures.py [NAME …] [--cycles] [--drawn-only] [--bare FOLDER]

Each haircut leaves out/haircuts/NAME.blend and NAME.png, of which the sheet is made; --cycles writes NAME_cycles.png
instead, and the sheet that compares them. out/haircuts/facts.json has the number of clicks, fields, views and strokes
of each haircut, and times.
"""

import argparse
import json
import os
import shutil
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import cat, head, portrait
from blend_samples.sheets import picture_files
from tests.desktop.haircuts.haircuts import HAIRCUTS
from tests.desktop.haircuts.hands import STRANDS
from tools import build_extension, compile_kernels, desktop_blender

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "out" / "haircuts"
FACTS = OUT / "facts.json"
BARE, BARE_CAT = "bare.blend", "bare_cat.blend"
SHEET, COMPARED = (ROOT / "docs" / "manual" / f"{name}.jpg" for name in ("haircuts", "haircuts_cycles"))
WIDTH, HEIGHT = 250, 290  # pixels of a picture
COLUMNS = 3
WINDOW_SIZE = (560, 440)
SHOWN = 300  # strands in the window, which software drivers draw slowly
MORE_STRANDS = {"cat": 90_000}  # of haircuts that need more than `STRANDS`
CYCLES_SAMPLES = 48
COMPARISON = (("", "Vellus"), ("_cycles", "Cycles"))  # endings of names, and labels

# Place of the camera [m] of each haircut.
_QUARTER, _BEHIND, _LEFT_BEHIND = (0.75, -1.15, 0.80), (0.60, 1.20, 0.86), (1.20, 0.75, 0.86)
CAMERAS = {
    "wavy": _QUARTER,
    "bob": (-0.65, -1.2, 0.80),
    "fade": (0.95, -0.85, 0.80),
    "bun": (1.20, 0.50, 0.88),
    "ponytail": _LEFT_BEHIND,
    "braids": (0.35, -1.30, 0.82),
    "cornrows": (1.1, -0.55, 1.1),
    "beard": (0.60, -1.25, 0.72),
    "cat": (0.75, -0.95, 0.42),
}
_FACE, _CAT = Vector((0.0, -0.02, 0.69)), Vector((0.01, 0.03, 0.165))  # [m] what the camera looks at


def main(arguments):
    """Cut and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(HAIRCUTS)}, all by default")
    parser.add_argument("--cycles", action="store_true", help="draw by Cycles")
    parser.add_argument("--bare", type=Path, help="only write the head and the cat without hair to a folder")
    parser.add_argument("--drawn-only", action="store_true", help="draw the files that an earlier call left")
    given = parser.parse_args(arguments)
    hair_addon.register()
    gpu.init()
    if given.bare is not None:
        save_bare(given.bare)
        return
    names = given.names or list(HAIRCUTS)
    if not given.drawn_only:
        save_bare(OUT)
        for name in names:
            cut(name)
    for name in names:
        draw(name, given.cycles)
    if given.cycles:
        write_sheet(COMPARED, [(f"{name}{end}", label) for name in names for end, label in COMPARISON], 4)
    else:
        write_sheet(SHEET, [(name, name.title()) for name in HAIRCUTS if (OUT / f"{name}.png").exists()])


def save_bare(folder):
    """Write the head and the cat without hair to a folder, with camera and lights, as an artist finds them."""
    folder.mkdir(parents=True, exist_ok=True)
    skull = head.build()
    portrait.dress(skull, portrait.AHEAD)
    head.light()
    bpy.context.view_layer.objects.active = skull
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / BARE))
    animal = cat.build()
    head.light()
    bpy.context.view_layer.objects.active = animal
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / BARE_CAT))


def cut(name):
    """Make a haircut in a window and save its file. Raises `RuntimeError`."""
    extension = build_extension.build(compile_kernels.this_platform(), "tests")
    profile, log = OUT / "profile", OUT / f"{name}.log"
    shutil.rmtree(profile, ignore_errors=True)  # it may contain an older version of the extension
    profile.mkdir(parents=True)
    script = ROOT / "tests" / "desktop" / "haircuts" / "in_window.py"
    bare = OUT / (BARE_CAT if name == "cat" else BARE)
    words = [name, extension, OUT, bare, SHOWN, MORE_STRANDS.get(name, STRANDS)]
    blender = desktop_blender.find_or_install()
    before = _done_count(name)
    status = blender.run(script, words, profile=profile, log=log, limit=900, size=WINDOW_SIZE)
    if status or _done_count(name) == before:
        raise RuntimeError(f"{name}: status {status}, see {log}")


def _done_count(name):
    """Return how often a haircut was finished."""
    return json.loads(FACTS.read_text())["done"].count(name) if FACTS.exists() else 0


def draw(name, by_cycles=False):
    """Write the picture of a haircut to OUT."""
    bpy.ops.wm.open_mainfile(filepath=str(OUT / f"{name}.blend"))
    light(CAMERAS[name], _CAT if name == "cat" else _FACE)
    if by_cycles:
        scene = bpy.context.scene
        scene.render.engine, scene.cycles.samples = "CYCLES", CYCLES_SAMPLES
        scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
        picture = picture_files.rendered()
    else:
        bpy.context.scene.vellus.multiple_scattering = "DUAL"  # without a GPU, light paths take minutes
        picture = picture_files.drawn_at_once(WIDTH, HEIGHT, 3)
    picture_files.write(picture, OUT / f"{name}{'_cycles' if by_cycles else ''}.png")


def light(place, middle):
    """Move camera and lights, so that the key light is at the camera's right."""
    scene = bpy.context.scene
    scene.camera.data.lens, scene.camera.location = 88.0, place
    head.point_at(scene.camera, middle)
    around = np.arctan2(place[1], place[0])
    for name, turn, height, away, watts in (
        ("Key", 0.75, 1.25, 1.5, 32.0),
        ("Rim", 3.6, 1.35, 1.1, 30.0),
        ("Fill", -0.9, 0.9, 1.4, 9.0),
    ):
        lamp = bpy.data.objects[name]
        lamp.location = (away * np.cos(around + turn), away * np.sin(around + turn), height)
        lamp.data.energy = watts
        head.point_at(lamp, middle)
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.20, 0.20, 0.20, 1.0)
    bpy.context.view_layer.update()


def write_sheet(path, pictures, columns=COLUMNS):
    """Write a sheet of the manual from pictures in OUT [(name, label)]."""
    read = [picture_files.below_caption(picture_files.read(OUT / f"{name}.png")) for name, _label in pictures]
    height = len(read[0])
    read += [np.full_like(read[0], picture_files.BACKGROUND)] * (-len(read) % columns)
    words = [
        (label, WIDTH * (place % columns) + 8, height * (place // columns) + picture_files.BASELINE)
        for place, (_name, label) in enumerate(pictures)
    ]
    picture_files.write(picture_files.rows(read, columns), path, words)


if __name__ == "__main__":
    main(sys.argv[1:])
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
