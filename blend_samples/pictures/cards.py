# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands beside the cards that stand for them: `python blend_samples/pictures/cards.py` draws docs/manual/cards.jpg.

Two rows, strands and cards, from three sides in the same light and once with the light behind, rendered by Cycles,
which takes many minutes on two cores.
"""

import argparse
import math
import os
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import portrait
from blend_samples.pictures import styles
from blend_samples.sheets import picture_files
from hair_addon import api

ROOT = Path(__file__).resolve().parents[2]
SIZE = 300, 320  # pixels of a picture
SIDES = ((0.0, 0.0), (105.0, 105.0), (200.0, 200.0), (30.0, 200.0))  # degrees that the camera and the lights are turned
BOUNCES = 64  # of rays through transparent parts of cards: more than cards lie over each other


def main():
    """Render both rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "manual" / "cards.jpg")
    parser.add_argument("--style", default="WAVY")
    parser.add_argument("--strands", type=int, default=12_000)
    parser.add_argument("--cards", type=int, default=1200)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--textures", type=int, default=1024)
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    hair = build(options.strands, options.style)
    (cards,) = api.make_hair_cards(hair, card_count=options.cards, texture_size=options.textures)
    shown = (bpy.data.objects["Hair"], cards)
    rows = []
    for one in shown:
        for other in shown:
            other.hide_render = other != one
        rows.append(np.concatenate([rendered(sides, options.samples) for sides in SIDES], axis=1))
    picture_files.write(np.concatenate(rows), options.out.resolve())


def build(strand_count, style):
    """The dressed head with styled hair, camera and lights, which turn; returns the hair Curves."""
    hair = styles.build(strand_count=strand_count)
    portrait.dress(bpy.data.objects["Head"])
    hair.vellus.hair.point_count, hair.vellus.hair.tip_taper = 41, 0.2
    api.apply_style_preset(hair, style)
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    for kind in ("CAMERA", "LIGHT"):
        pivot = bpy.data.objects.new(f"{kind} Pivot", None)
        scene.collection.objects.link(pivot)
        for turned in [o for o in scene.objects if o.type == kind]:
            turned.parent = pivot
    scene.cycles.transparent_max_bounces = BOUNCES
    return hair


def rendered(sides, sample_count):
    """Return the scene by Cycles, from a side."""
    for kind, angle in zip(("CAMERA", "LIGHT"), sides, strict=True):
        bpy.data.objects[f"{kind} Pivot"].rotation_euler.z = math.radians(angle)
    return picture_files.drawn(*SIZE, engine="cycles", sample_count=sample_count)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
