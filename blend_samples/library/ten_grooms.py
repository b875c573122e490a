# SPDX-License-Identifier: GPL-3.0-or-later
"""The ten grooms of the library, by code: `python blend_samples/library/ten_grooms.py` draws the sheet docs/grooms.png.

From the left: pixie, bob, long wavy, curly, coily; braid, beard, eyebrows, short fur, long fur. Vellus draws each
picture in half a minute. `make samples ARGS=grooms` saves them as small files in the add-on's folder.
"""

import argparse
import hashlib
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.library import face_grooms, fur_grooms, head_grooms, small_grooms
from blend_samples.sheets import picture_files
from hair_addon.blender.io import groom_library

ROOT = Path(__file__).resolve().parents[2]
PAGE, PAGE_WIDTH = ROOT / "docs" / "manual" / "groom_library.png", 560  # pixels
SIZE = 288, 340  # pixels of a picture
PREVIEW = 192  # pixels of a picture in the Asset Browser
DIGESTS = "SHA256SUMS"
SAMPLE_COUNT = 24  # of a pixel
COLUMNS = 5
_LOCATION = (0.70, -1.28, 0.73)  # [m]: of the camera


def dressed_head():
    """Return the sample's head with a face and a bust."""
    head_object = head.build()
    portrait.dress(head_object)
    return head_object


@dataclass(frozen=True)
class Sample:
    """How a groom is made and seen."""

    surface: Callable  # () → the object that it grows on
    groom: Callable  # (the object, number of strands) → hair Curves
    strand_count: int
    catalog: str
    look_at: tuple[float, float, float]  # [m]
    lens: float  # [mm]
    bare_surface: Callable = head.load  # () → the object without its subdivision, for small files
    stride: int = 1  # small files keep every nth point of guides


_HEAD, _LOW = (0.004, -0.045, 0.725), (0.004, -0.050, 0.690)

SAMPLES = {
    "Pixie": Sample(dressed_head, head_grooms.pixie, 30_000, "Hair/Head", _HEAD, 150.0, stride=2),
    "Bob": Sample(dressed_head, head_grooms.bob, 30_000, "Hair/Head", _HEAD, 150.0),
    "Long Wavy": Sample(dressed_head, head_grooms.long_wavy, 30_000, "Hair/Head", (0.0, -0.05, 0.655), 112.0),
    "Curly": Sample(dressed_head, head_grooms.curly, 30_000, "Hair/Head", (0.0, -0.05, 0.710), 128.0),
    "Coily": Sample(dressed_head, head_grooms.coily, 24_000, "Hair/Head", (0.0, -0.05, 0.750), 122.0, stride=2),
    "Braid": Sample(dressed_head, head_grooms.braid, 30_000, "Hair/Head", (0.0, -0.05, 0.640), 108.0),
    "Beard": Sample(dressed_head, face_grooms.beard, 12_000, "Hair/Face", (0.010, -0.060, 0.712), 150.0, stride=2),
    "Eyebrows": Sample(dressed_head, face_grooms.eyebrows, 1600, "Hair/Face", (0.004, -0.135, 0.738), 360.0),
    "Short Fur": Sample(
        fur_grooms.build, fur_grooms.short_fur, 60_000, "Hair/Fur", (0.026, -0.040, 0.712), 146.0, fur_grooms.load, 4
    ),
    "Long Fur": Sample(
        fur_grooms.build, fur_grooms.long_fur, 60_000, "Hair/Fur", (0.026, -0.040, 0.708), 134.0, fur_grooms.load, 2
    ),
}


def main():
    """Draw the requested pictures, all by default; the sheet is written only if all were drawn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="grooms such as Pixie; all by default")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "grooms.png")
    parser.add_argument("--page", type=Path, default=PAGE, help="a smaller copy, for the manual")
    parser.add_argument("--strands", type=float, default=1.0, help="factor of the numbers of strands")
    parser.add_argument("--samples", type=int, default=SAMPLE_COUNT)
    given = parser.parse_args()
    hair_addon.register()
    gpu.init()
    pictures = []
    for name in given.names or list(SAMPLES):
        build(name, given.strands)
        pictures.append(picture_files.drawn(*SIZE, sample_count=given.samples))
    sheet = picture_files.rows(pictures, min(COLUMNS, len(pictures)))
    picture_files.write(sheet, given.out.resolve(), kept_bits=picture_files.PAGE_BITS)
    small = picture_files.scaled(sheet, PAGE_WIDTH)
    picture_files.write(small, given.page.resolve(), kept_bits=picture_files.PAGE_BITS)


def build_library(folder, names=()):
    """Save grooms, all by default, as small files with small pictures to a folder, and list the digests of its files.

    Each save writes different bytes, so a changed list shows which files were saved again.
    """
    gpu.init()
    for name in names or SAMPLES:
        hair = build(name)
        picture = picture_files.drawn(PREVIEW, PREVIEW, sample_count=SAMPLE_COUNT)
        save(name, hair, folder, picture & picture_files.FEW_BITS)
    lines = [
        f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(folder.glob("*.blend"))
    ]
    (folder / DIGESTS).write_text("".join(lines), encoding="utf-8")


def save(name, hair, folder, picture):
    """Save a groom as a small file with a picture (N, N, 3) uint8, the top row first."""
    sample = SAMPLES[name]
    opaque = np.dstack([picture[::-1] / np.float32(255.0), np.ones(picture.shape[:2], np.float32)])
    groom = small_grooms.small(hair, name, sample.bare_surface, sample.stride)
    path = groom_library.path_of(folder, name)
    groom_library.write(path, [(groom, opaque)], sample.catalog)
    print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB")


def build(name, strands=1.0):
    """Build a groom of `SAMPLES` with its camera and lights; strands: factor of their number. Returns the hair."""
    sample = SAMPLES[name]
    hair = sample.groom(sample.surface(), int(strands * sample.strand_count))
    portrait.light()
    camera = bpy.context.scene.camera
    camera.data.dof.use_dof = False
    camera.data.lens = sample.lens
    camera.location = _LOCATION
    head.point_at(camera, sample.look_at)
    bpy.context.view_layer.update()
    return hair


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
