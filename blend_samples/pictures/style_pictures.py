# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's pictures of styles: three values of each main setting.

`python blend_samples/pictures/style_pictures.py curl_radius` draws one of them, without a name all.

Writes docs/manual/style_STYLE_SETTING.png: a lock that hangs, or hair that stands, drawn by Vellus.
"""

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path

import bpy
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.pictures import look_pictures
from blend_samples.sheets import picture_files
from hair_addon import api
from hair_addon.blender.data.strands import selection_sets

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual"
WIDTH, HEIGHT, CAPTION = 160, 200, 24  # pixels of a picture, and of the words above it
LENGTH = 0.16  # [m]
STRAND_COUNT = 2500
POINT_COUNT = 161

CLUMP = api.Clump(size=0.014, levels=2, amount=0.95, shape=0.2, stray=0.0)
TIGHT = api.Clump(size=0.016, levels=1, amount=1.0, thickness=0.05, shape=0.1, crossover=0.0, stray=0.0)
CURL = api.Curl(radius=0.006, pitch=0.032, coherence=1.0, seed=1)
FRIZZ = api.Frizz(amplitude=0.002, wavelength=0.03, seed=2)
BRAID = api.Braid(size=0.022)

# (file, unit of the captions, styles before, style, setting, three values); with the hair that it is shown on.
HANGING = (
    ("trim_factor", "Factor {:g}", (), api.Trim(), "factor", (1.0, 0.75, 0.5)),
    ("trim_random", "Random {:g}", (), api.Trim(to_length=0.13), "random", (0.0, 0.3, 0.8)),
    (
        "clump_centers",
        "{}",
        (),
        replace(TIGHT, centers="GUIDES"),
        "center_guides",
        ("3 guides", "7 guides", "20 guides"),
    ),
    ("clump_size", "Size {mm:g} mm", (), CLUMP, "size", (0.007, 0.014, 0.03)),
    ("clump_fine_amount", "Fine {:g}", (), replace(CLUMP, size=0.03, amount=0.6), "fine_amount", (0.0, 0.8, 1.6)),
    ("clump_thickness", "Thickness {:g}", (), replace(TIGHT, size=0.016), "thickness", (0.04, 0.2, 0.5)),
    ("curl_radius", "Radius {mm:g} mm", (TIGHT,), CURL, "radius", (0.003, 0.006, 0.01)),
    ("curl_pitch", "Pitch {mm:g} mm", (TIGHT,), CURL, "pitch", (0.016, 0.032, 0.064)),
    ("curl_flatness", "Flatness {:g}", (TIGHT,), CURL, "flatness", (0.0, 0.5, 1.0)),
    ("frizz_amplitude", "Amplitude {mm:g} mm", (), FRIZZ, "amplitude", (0.001, 0.003, 0.006)),
    ("frizz_wavelength", "Wavelength {mm:g} mm", (), FRIZZ, "wavelength", (0.015, 0.03, 0.08)),
    (
        "smooth_length",
        "Length {mm:g} mm",
        (replace(FRIZZ, amplitude=0.003),),
        api.Smooth(),
        "length",
        (0.0, 0.015, 0.04),
    ),
    ("braid_radius", "Radius {mm:g} mm", (), BRAID, "radius", (0.003, 0.005, 0.008)),
    ("braid_pattern", "{}", (), BRAID, "pattern", ("BRAID", "ROPE")),
    ("wet_amount", "Amount {:g}", (FRIZZ,), api.Wet(seed=3), "amount", (0.0, 0.5, 1.0)),
    ("wet_lock", "Lock size {mm:g} mm", (FRIZZ,), api.Wet(amount=0.8, seed=3), "lock", (0.008, 0.016, 0.032)),
)
STANDING = (
    ("trim_undercoat", "Undercoat {:g}", (), api.Trim(undercoat_length=0.5), "undercoat", (0.0, 0.6, 0.95)),
    ("bend_angle", "Angle {degrees:.0f}°", (), api.Bend(), "angle", (0.0, 1.0, 3.0)),
    ("lean_amount", "Amount {:g}", (), api.Lean(), "amount", (0.0, 0.3, 0.6)),
)


def main():
    """Draw the requested pictures, all by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="strips such as curl_radius; all by default")
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    hair_addon.register()
    gpu.init()
    given.out.mkdir(parents=True, exist_ok=True)
    for grow, strips in ((grow_hanging, HANGING), (grow_standing, STANDING)):
        chosen = [strip for strip in strips if not given.names or strip[0] in given.names]
        if chosen:
            hair = grow()
            for strip in chosen:
                draw_strip(hair, strip, given.out.resolve())


def grow_hanging():
    """Hair that hangs from a small patch; returns its Curves."""
    hair = _grown(0.062, 0.016, 0.5 * LENGTH, -1, hang)
    _camera((0.0, 0.0, 0.0), 1.05 * LENGTH)
    return hair


def grow_standing():
    """Hair that stands on a small patch and leans a little; returns its Curves."""
    hair = _grown(0.05, 0.02, 0.0, 1, stand)
    _camera((0.009, 0.0, 0.036), 0.17)
    return hair


def _grown(width, depth, height, side, comb):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0.0, 0.0, height))
    patch = bpy.context.object
    # A surface faces the way its hair grows: wet hair keeps clear of it on that side.
    patch.data.transform(((width, 0, 0, 0), (0, side * depth, 0, 0), (0, 0, side, 0), (0, 0, 0, 1)))
    patch.hide_render = True
    bpy.ops.vellus.add_hair(
        guide_count=60,
        length=LENGTH,
        length_variation=0.05,
        tilt=0.0,
        gravity=0.0,
        strand_count=STRAND_COUNT,
        radius=8e-5,
    )
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"].data
    points = np.empty((len(guides.data.points), 3), np.float32)
    guides.data.attributes["position"].data.foreach_get("vector", points.ravel())
    comb(points.reshape(len(guides.data.curves), -1, 3))
    guides.data.attributes["position"].data.foreach_set("vector", points.ravel())
    _save_selections(guides.data, points.reshape(len(guides.data.curves), -1, 3))
    guides.data.update_tag()
    guides.hide_set(True)
    look_pictures.light()
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.12, 0.12, 0.13, 1.0)
    hair.vellus.hair.point_count = POINT_COUNT
    look = hair.vellus.appearance
    look.mode, look.absorption, look.roughness, look.random_color = "energy", (0.12, 0.26, 0.6), 0.3, 0.1
    return hair


def _save_selections(guides, points):
    """Save guides that are spaced evenly from left to right as selections for the centers of locks."""
    order = np.argsort(points[:, 0, 0])
    for count in (3, 7, 20):
        chosen = order[((np.arange(count) + 0.5) * len(order) / count).astype(int)]
        are_chosen = np.isin(np.arange(len(points)), chosen)
        selection_sets.write(guides, f"{count} guides", np.repeat(are_chosen, points.shape[1]))


def hang(strands):
    """Let guides fall straight from their roots."""
    along = np.linspace(0.0, 1.0, strands.shape[1])[None, :]
    strands[..., :2] = strands[:, :1, :2] * (1.0 - 0.15 * along[..., None] ** 2)
    strands[..., 2] = strands[:, :1, 2] - LENGTH * along * np.linspace(0.95, 1.0, len(strands))[:, None]


def stand(strands):
    """Let short guides stand and lean to the side."""
    along = np.linspace(0.0, 1.0, strands.shape[1])[None, :]
    length = 0.07 * np.linspace(0.92, 1.0, len(strands))[:, None]
    strands[..., 0] = strands[:, :1, 0] + 0.45 * length * along**1.2
    strands[..., 1] = strands[:, :1, 1]
    strands[..., 2] = strands[:, :1, 2] + 0.9 * length * along


def _camera(center, scale):
    camera = bpy.context.scene.camera
    camera.location = (center[0], -1.0, center[2])
    camera.data.ortho_scale, camera.data.sensor_fit = scale, "VERTICAL"


def draw_strip(hair, strip, out):
    """Write the pictures of three values side by side, each with its caption."""
    name, caption, before, style, setting, values = strip
    pictures, words = [], []
    for place, value in enumerate(values):
        shown = () if value == 0.0 and setting == "length" else (replace(style, **{setting: value}),)
        api.set_styles(hair, [*before, *shown])
        bpy.context.view_layer.update()
        pictures.append(picture_files.below_caption(picture_files.drawn(WIDTH, HEIGHT)))
        scaled = {"mm": 1e3 * value, "degrees": np.degrees(value)} if isinstance(value, float) else {}
        label = caption.format(value if isinstance(value, float) else value.title(), **scaled)
        words.append((label, WIDTH * place + 8, picture_files.BASELINE))
    path = out / f"style_{name}.png"
    picture_files.write(np.concatenate(pictures, axis=1), path, words, picture_files.PAGE_BITS)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
