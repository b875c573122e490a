# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds each sample .blend from code: make samples. ARGS=grooms builds the grooms that come with the add-on."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import hair_addon
from blend_samples.comparisons import parting
from blend_samples.dynamics import dynamics_film, dynamics_scene
from blend_samples.heads import head, portrait
from blend_samples.library import ten_grooms
from hair_addon.blender.settings import asset_libraries

FOLDER = Path(__file__).resolve().parent


def build_head():
    """The head with 200 guides and 30,000 strands."""
    skull = head.build()
    head.grow(skull)
    portrait.dress(skull)
    head.light()


def build_parting():
    """The head with a part line along its parting."""
    skull = head.build()
    _guides, hair = head.grow(skull, guide_count=300)
    hair.data.vellus.hair.part_lines = parting.draw_part_line(skull).name
    bpy.context.view_layer.update()
    portrait.dress(skull)
    head.light()


def build_dynamics():
    """The head, which turns to the side and back, with hair that simulates: play it, or bake it."""
    dynamics_scene.build()
    dynamics_film.prepare()


SAMPLES = {"head": build_head, "parting": build_parting, "dynamics": build_dynamics}


def main():
    """Build the samples named on the command line, or all."""
    hair_addon.register()
    for name in sys.argv[1:] or SAMPLES:
        if name == "grooms":  # an asset library, a file each
            ten_grooms.build_library(asset_libraries.SHIPPED)
            continue
        SAMPLES[name]()
        path = FOLDER / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        print(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
