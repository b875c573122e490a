# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of the presets' menu: `python blend_samples/pictures/style_preset_pictures.py` draws each style preset.

Writes hair_addon/presets/PRESET.png with a transparent background: the sample head, and for beards and fur a ball.
"""

import argparse
import os
import sys
from pathlib import Path

import bpy
import gpu

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.pictures import styles
from hair_addon import api
from hair_addon.core.files import style_presets

SIZE = 96  # pixels
ON_A_BALL = ("BEARD", "FUR_SHORT", "FUR_LONG")
BALL_RADIUS = 0.06  # [m]
STRAND_RADIUS = 1.1e-4  # [m]: strands that are seen in a small picture


def main():
    """Draw the requested presets, all by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="presets such as CURLY; all by default")
    names = parser.parse_args().names or list(style_presets.PRESETS)
    hair_addon.register()
    gpu.init()
    for grow, chosen in (
        (grow_on_head, [name for name in names if name not in ON_A_BALL]),
        (grow_on_ball, [name for name in names if name in ON_A_BALL]),
    ):
        if chosen:
            hair = grow()
            for name in chosen:
                draw(hair, name)


def grow_on_head():
    """The gallery's head, a little closer; returns the hair Curves."""
    hair = styles.build(strand_count=8000)
    camera = bpy.context.scene.camera.data
    camera.lens, camera.shift_x, camera.shift_y = 100.0, 0.04, -0.02
    return hair


def grow_on_ball():
    """A ball of fur in the gallery's light; returns the hair Curves."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=BALL_RADIUS, segments=48, ring_count=24, location=head.LOOK_AT)
    ball = bpy.context.object
    ball.data.materials.append(head.skin())
    bpy.ops.object.shade_smooth()
    bpy.ops.vellus.add_hair(guide_count=300, length=0.04, tilt=0.5, gravity=0.3, strand_count=40_000)
    bpy.data.objects["Hair Guides"].hide_set(True)
    head.light()
    hair = bpy.data.objects["Hair"].data
    styles.light(hair)
    camera = bpy.context.scene.camera.data
    camera.lens, camera.shift_x, camera.shift_y = 140.0, 0.0, 0.0
    return hair


def draw(hair, name):
    """Write the picture of a preset beside its file."""
    api.set_styles(hair, [])
    bpy.context.view_layer.update()
    api.apply_style_preset(hair, name, fit=name not in ON_A_BALL)
    hair.vellus.hair.radius = STRAND_RADIUS
    bpy.context.view_layer.update()
    path = style_presets.FOLDER / f"{name.lower()}.png"
    picture = {"width": SIZE, "height": SIZE, "samples_per_side": 4, "is_transparent": True}
    bpy.ops.vellus.render_picture(filepath=str(path), **picture)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
