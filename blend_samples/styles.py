# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery of styles: `python blend_samples/styles.py` draws docs/styles.png and docs/wet.png.

One head and one light for all of them. Vellus draws each picture, so all take two minutes.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import guide_tool_pictures  # beside this file
import head
import portrait

import hair_addon
from hair_addon import api

ROOT = Path(__file__).resolve().parent.parent
GALLERY = ("STRAIGHT", "WAVY", "CURLY", "COILY", "FRIZZY", "WET", "PIXIE", "BUZZ")
WETNESS = (0.0, 0.25, 0.5, 0.75, 1.0)
STRAND_COUNT = 30_000
SIZE = 360, 420  # pixels of a picture
SAMPLE_COUNT = 16  # of a pixel
KEPT_BITS = 0xFC  # of a color: the pictures are pages of the documentation
COLUMNS = 4
LENS = 92.0  # [mm]: the head and its hair fill a picture
CAMERA = (1.06, -0.93, 0.82)  # [m]: from the side, where most of the hair is
LIGHTS = {"Key": 24.0, "Rim": 6.0, "Fill": 8.0}  # [W]: a weak rim, which shows a halo and does not whiten curls


def main():
    """Draw what is asked for, all by default; the exit status is 0 only if all of it was drawn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="styles, or wet for the row of wetness; all by default")
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    given = parser.parse_args()
    hair_addon.register()
    gpu.init()
    hair = build()
    portrait.dress(bpy.data.objects["Head"])
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    chosen = [name for name in GALLERY if not given.names or name in given.names]
    pictures = [_drawn_style(hair, name) for name in chosen]
    if pictures:
        save(_rows(pictures, COLUMNS), out / "styles.png")
    if not given.names or "wet" in given.names:
        save(_rows([_drawn_wet(hair, wetness) for wetness in WETNESS], len(WETNESS)), out / "wet.png")


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
    camera.rotation_euler = (head.LOOK_AT - camera.location).to_track_quat("-Z", "Y").to_euler()
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
    """(height, width, 3) uint8 through the scene's view transform, the top row first."""
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = SIZE
    with tempfile.TemporaryDirectory() as folder:
        path = api.render(Path(folder) / "picture.png", width=SIZE[0], height=SIZE[1], sample_count=SAMPLE_COUNT)
        image = bpy.data.images.load(str(path))
        pixels = np.empty((image.size[1], image.size[0], image.channels), np.float32)
        image.pixels.foreach_get(pixels.ravel())
        bpy.data.images.remove(image)
    return np.round(255.0 * pixels[::-1, :, :3]).astype(np.uint8)


def _rows(pictures, columns):
    rows = [pictures[first : first + columns] for first in range(0, len(pictures), columns)]
    return np.concatenate([np.concatenate(row, axis=1) for row in rows if len(row) == len(rows[0])])


def save(pixels, path):
    height, width, _ = pixels.shape
    image = bpy.data.images.new(path.stem, width, height)
    opaque = np.ones((height, width, 4), np.float32)
    opaque[..., :3] = (pixels[::-1] & KEPT_BITS) / np.float32(255.0)
    image.pixels.foreach_set(opaque.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    guide_tool_pictures.compress(path)
    print(path)


if __name__ == "__main__":
    main()
