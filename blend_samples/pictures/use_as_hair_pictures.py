# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/use_as_hair.png: strands that came as curves, and what guides derived from them reproduce."""

import os
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.pictures.transfer_picture import SIZE, drawn, dressed_head, light
from blend_samples.sheets import picture_files
from hair_addon import api

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "use_as_hair.png"
STRANDS = 9000
CUT = 16  # pixels off either side of a picture
WIDTH = SIZE[0] - 2 * CUT
SAMPLE_COUNT = 16  # of a pixel
COUNTS = (None, 400, 60)  # of guides; None: the strands themselves


def main():
    """Grow hair with styles, take it for curves of somebody else, use them, and draw."""
    hair_addon.register()
    skull = dressed_head()
    own = {*bpy.context.scene.objects}
    guides, hair = head.grow(skull, guide_count=260, strand_count=STRANDS)
    api.add_style(hair, "CLUMP", size=0.02, amount=0.6)
    api.add_style(hair, "WAVE", radius=0.006, pitch=0.06)
    bpy.context.view_layer.update()
    points, look = api.points(hair), api.settings_of(hair).appearance
    for made in (guides, hair):
        bpy.data.objects.remove(made)
    light()
    bpy.context.scene.camera.data.lens = 118.0
    pictures, words = [], []
    for count in COUNTS:
        came = curves_of(points)
        used = api.use_as_hair(came, skull, guide_count=count or 60, follows_guides=count is not None)
        used.hair.vellus.marschner.size = 64
        api.shade(used.hair, look)
        error = f"{100.0 * used.mean_error:.1f}% (95%: {100.0 * used.high_error:.1f}%)"
        words.append(f"{STRANDS} strands, as they came" if count is None else f"{count} guides: {error}")
        pictures.append(drawn(own | {came}, SAMPLE_COUNT)[:, CUT:-CUT])
        print(words[-1])
        bpy.data.objects.remove(came)
    titles = [(word, WIDTH * place + 8, picture_files.BASELINE) for place, word in enumerate(words)]
    picture_files.write(np.concatenate(pictures, axis=1), OUT, titles, picture_files.FEW_BITS)


def curves_of(points):
    """Return an object of curves (S, P, 3) that Vellus did not make, 0.2 mm thick."""
    datablock = bpy.data.hair_curves.new("Imported")
    datablock.add_curves([points.shape[1]] * len(points))
    datablock.set_types(type="POLY")
    datablock.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(points, np.float32).ravel())
    radii = np.tile(np.linspace(1.3e-4, 0.3e-4, points.shape[1], dtype=np.float32), len(points))
    datablock.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    made = bpy.data.objects.new("Imported", datablock)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.update()
    return made


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
