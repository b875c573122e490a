# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/gather.png: hair that Gather leads through ties, drawn by Vellus: ponytail, bun, braids, a
rope and cornrows."""

import os
import sys
import tempfile
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.sheets import picture_files
from hair_addon import api
from tests.desktop.haircuts.haircuts import ASIDE, row

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "gather.png"
WIDTH, HEIGHT = 180, 220  # pixels of a picture
COLUMNS = 5
LENGTH = 0.36  # [m] of guides

BACK = (0.0, 0.030, 0.795)  # [m] a place near the tie of ponytail and bun
TAIL = (BACK, (0.0, 0.062, 0.805), (0.0, 0.085, 0.785), (0.0, 0.088, 0.74), (0.0, 0.075, 0.60))
SIDE = ((0.062, 0.012, 0.715), (0.085, 0.022, 0.700), (0.092, 0.012, 0.660), (0.088, -0.01, 0.56))
BRAIDS = (SIDE, tuple((-x, y, z) for x, y, z in SIDE))
ROWS = tuple(row(aside, 0.55 * aside**2 - 1.1, 2.25) for aside in ASIDE)
LOOKS = (
    ("Ponytail", (TAIL,), {"shape": "PONYTAIL"}),
    ("Bun", ((BACK, (0.0, 0.06, 0.82)),), {"shape": "BUN", "bun_radius": 0.036}),
    ("Braids", BRAIDS, {"shape": "BRAID", "tail_radius": 0.015, "tie_radius": 0.009, "pitch": 0.06}),
    ("Rope, Tightness 0.4", (TAIL,), {"shape": "ROPE", "tail_radius": 0.016, "pitch": 0.09, "tightness": 0.4}),
    (
        "Cornrows",
        ROWS,
        {"shape": "CORNROWS", "tie_radius": 0.008, "clearance": 0.0005, "tightness": 1.0},
    ),
)


def main(out=OUT, size=(WIDTH, HEIGHT), only=None):
    """Gather the same hair in each way, and draw."""
    hair_addon.register()
    skull = head.build()
    portrait.dress(skull, portrait.AHEAD)
    grow(skull)
    light()
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        loose = os.path.join(folder, "loose.blend")
        bpy.ops.wm.save_as_mainfile(filepath=loose)
        for title, lines, values in LOOKS:
            if only and title not in only:
                continue
            bpy.ops.wm.open_mainfile(filepath=loose)
            settings = dict(values, line=add_lines(lines).name, selected_only=False)
            api.change_guides(bpy.data.objects["Guides"], "GATHER", **settings)
            bpy.context.view_layer.update()
            pictures.append(picture_files.below_caption(picture_files.drawn_at_once(*size, 4)))
    words = [
        (title, size[0] * (place % COLUMNS) + 8, picture_files.BASELINE)
        for place, title in enumerate(title for title, _lines, _values in LOOKS if not only or title in only)
    ]
    picture_files.write(picture_files.rows(pictures, COLUMNS), out, words, picture_files.FEW_BITS)


def grow(skull):
    """Long hair of smooth strands on a head."""
    guides, hair = head.grow(skull, guide_count=2000, strand_count=24_000)
    guides.data.vellus.guides.length = LENGTH
    api.change_guides(guides, "LENGTH", method="SET", length=LENGTH)
    api.set_styles(hair.data, [api.Frizz(amplitude=0.0004, wavelength=0.06, stray=0.03, stray_gain=12.0)])
    hair.data.vellus.hair.radius, hair.data.vellus.marschner.size = 1.1e-4, 64
    bpy.context.view_layer.update()


def add_lines(lines):
    """Return a curve object of straight segments through places [m]."""
    data = bpy.data.curves.new("Ties", "CURVE")
    data.dimensions = "3D"
    for line in lines:
        spline = data.splines.new("POLY")
        spline.points.add(len(line) - 1)
        for point, place in zip(spline.points, line, strict=True):
            point.co = (*place, 1.0)
    found = bpy.data.objects.new("Ties", data)
    bpy.context.scene.collection.objects.link(found)
    bpy.context.view_layer.update()
    return found


def light():
    """The sample's lights, turned, and a camera behind the head."""
    head.light()
    camera = bpy.context.scene.camera
    camera.data.lens = 100.0
    camera.location = (0.85, 1.05, 0.86)
    head.point_at(camera, (0.0, -0.01, 0.715))
    bpy.data.objects["Key"].location = (1.35, 0.9, 1.3)
    bpy.data.objects["Rim"].location = (-0.6, -0.8, 1.25)
    bpy.data.objects["Fill"].location = (-0.9, 1.2, 0.9)
    for name in ("Key", "Rim", "Fill"):
        head.point_at(bpy.data.objects[name], (0.0, 0.0, 0.75))
    bpy.data.lights["Rim"].energy = 8.0
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.22, 0.22, 0.22, 1.0)
    bpy.context.view_layer.update()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
