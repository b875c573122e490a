# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery of styles: `python blend_samples/pictures/styles.py` draws docs/styles.png and docs/wet.png.

One head and one light for all of them. Vellus draws each picture, so all take two minutes.
"""

import argparse
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.sheets import picture_files
from hair_addon import api

ROOT = Path(__file__).resolve().parents[2]
GALLERY = ("STRAIGHT", "WAVY", "CURLY", "COILY", "FRIZZY", "WET", "PIXIE", "BUZZ")
WETNESS = (0.0, 0.25, 0.5, 0.75, 1.0)
STRAND_COUNT = 30_000
SIZE = 360, 420  # pixels of a picture
SAMPLE_COUNT = 16  # of a pixel
COLUMNS = 4
LENS = 92.0  # [mm]: the head and its hair fill a picture
CAMERA = (1.06, -0.93, 0.82)  # [m]: from the side, where most of the hair is
LIGHTS = {"Key": 24.0, "Rim": 6.0, "Fill": 8.0}  # [W]: a weak rim, which shows a halo and does not whiten curls


def main():
    """Draw the requested pictures, all by default; the exit status is 0 only if all were drawn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="styles, or wet for the row of wetness; all by default")
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    given = parser.parse_args()
    hair_addon.register()
    gpu.init()
    hair = build()
    portrait.dress(bpy.data.objects["Head"], portrait.AHEAD)
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    chosen = [name for name in GALLERY if not given.names or name in given.names]
    pictures = [_drawn_style(hair, name) for name in chosen]
    if pictures:
        _write(picture_files.rows(pictures, COLUMNS), out / "styles.png")
    if not given.names or "wet" in given.names:
        _write(np.concatenate([_drawn_wet(hair, wetness) for wetness in WETNESS], axis=1), out / "wet.png")


def _write(pixels, path):
    picture_files.write(pixels, path, kept_bits=picture_files.PAGE_BITS)


def build(strand_count=STRAND_COUNT):
    """The head with straight hair, camera and lights; returns the hair Curves."""
    head_object = head.build()
    _guides, hair = head.grow(head_object, strand_count=strand_count)
    head.light()
    light(hair.data)
    return hair.data


def light(hair):
    """The gallery's camera, lights and look, of the sample's scene and hair Curves."""
    camera = bpy.context.scene.camera
    camera.location = CAMERA
    head.point_at(camera, head.LOOK_AT)
    camera.data.lens, camera.data.sensor_fit, camera.data.shift_x, camera.data.shift_y = LENS, "VERTICAL", 0.02, -0.035
    for name, watts in LIGHTS.items():
        bpy.data.objects[name].data.energy = watts
    look = hair.vellus.appearance
    look.mode, look.absorption, look.roughness, look.random_color = "energy", head.AUBURN, 0.3, 0.15


def _drawn_style(hair, name):
    api.set_styles(hair, [])
    hair.vellus.hair.point_count = 41
    hair.vellus.hair.tip_taper = 0.2
    api.apply_style_preset(hair, name)
    bpy.context.view_layer.update()
    return drawn()


def _drawn_wet(hair, wetness):
    hair.vellus.hair.point_count, hair.vellus.hair.tip_taper = 81, 0.2
    frizz = api.Frizz(amplitude=0.002, wavelength=0.03, seed=1)
    api.set_styles(hair, [frizz, api.Wet(amount=wetness, lock=0.022, cling=0.45, relax=0.95, seed=2)])
    bpy.context.view_layer.update()
    return drawn()


def drawn():
    """Return the scene, in the gallery's size."""
    return picture_files.drawn(*SIZE, sample_count=SAMPLE_COUNT)


if __name__ == "__main__":
    main()
