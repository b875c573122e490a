# SPDX-License-Identifier: GPL-3.0-or-later
"""make demo: the report's pictures and its two results tables, made on this machine.

Writes head.blend, kajiya_kay.png, marschner.png, dual_scattering.png, styled.png (the same hair, curly) and
tables/{m,n,n_trt}.exr to a folder. --cycles adds cycles.png, the scene of dual_scattering.png in Cycles, which takes
minutes; --only-cycles writes nothing else. README's picture by Cycles uses --cycles-samples 128.
"""

import argparse
import os
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import hair_addon
from blend_samples.heads import portrait
from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.gpu import ambient_visibility, drawing, visibility_buffer
from hair_addon.blender.render import drawn_scene, hair_cache, offscreen, scene_drawing
from hair_addon.core.geometry.curves import bspline
from hair_addon.core.imaging.pixel_sampling import PictureSettings

STYLE = "CURLY"  # of styled.png
SAMPLES_PER_SIDE = 3  # of each pixel
PORTRAIT_SAMPLES_PER_SIDE = 4  # of dual_scattering.png
LENS_PASSES = 4  # of dual_scattering.png: blur is up to three pixels wide, and each pass draws all strands
SMALL_SIZE = 440, 440  # pixels of the other pictures, two of which are shown side by side
CYCLES_SAMPLES = 32  # by default; denoised, as Blender does unless told otherwise
MODELS = {"Kajiya-Kay": "KAJIYA_KAY", "Marschner": "MARSCHNER"}
REPORT_MILLISECONDS = {"recursion": 12.546, "subdivision": 5.653, "matrix": None}
STRAND_COUNT = 10_000  # of the report's second table
REPORT_FRAMES = {"Marschner": 25, "Kajiya-Kay": 36}


def main():
    """Make everything; the exit status is 0 only if all of it was made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/demo"))
    parser.add_argument("--cycles", action="store_true", help="also render the portrait by Cycles")
    parser.add_argument("--only-cycles", action="store_true", help="make no other picture and no table")
    parser.add_argument("--cycles-samples", type=int, default=CYCLES_SAMPLES, help="of each pixel by Cycles")
    options = parser.parse_args()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    started = time.perf_counter()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    _head, guides, hair = portrait.build()
    portrait.light()
    print(f"{len(guides.data.curves)} guides, {len(hair.data.curves)} strands in {time.perf_counter() - started:.1f} s")
    bpy.context.view_layer.objects.active = hair
    if options.cycles or options.only_cycles:
        draw_by_cycles(hair.data, out / "cycles.png", options.cycles_samples)
    if options.only_cycles:
        return
    bpy.ops.vellus.bake_tables(directory=str(out / "tables"))
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "head.blend"), compress=True)
    with as_auburn(hair.data):
        drawn = read()
        draw_portrait(drawn, out / "dual_scattering.png")
    for model in MODELS.values():
        portrait.make_chestnut(hair.data, model)
        draw(with_look(drawn, hair.data), out / f"{model.lower()}.png")
    with as_auburn(hair.data):
        draw_styled(hair.data, out / "styled.png")
    print_spline_table()
    print_frame_table(hair.data)
    print(f"\nmade in {time.perf_counter() - started:.1f} s: {out}")


def read():
    """Upload the present scene to the GPU, with its shadows."""
    context = bpy.context
    return drawn_scene.read(context.scene, context.view_layer, context.evaluated_depsgraph_get())


def with_look(drawn, hair):
    """Return the scene with the present look of the head's hair; the light that reaches it is unchanged."""
    index = ambient_visibility.densest([strands for strands, *_ in drawn.hair])
    strands, _shading, *placed = drawn.hair[index]
    shaded = (strands, hair_cache.shading_of(hair), *placed)
    return replace(drawn, hair=[*drawn.hair[:index], shaded, *drawn.hair[index + 1 :]])


def draw_portrait(drawn, path):
    """Draw a scene through the portrait's camera, with depth of field."""
    settings = PictureSettings(*portrait.SIZE, PORTRAIT_SAMPLES_PER_SIDE)
    _write(offscreen.draw_picture(settings, drawn, LENS_PASSES), path)


def draw(drawn, path):
    """Draw a small picture of a scene through the portrait's camera, all in focus."""
    lens = bpy.context.scene.camera.data.dof
    lens.use_dof = False
    pixels = offscreen.draw_picture(PictureSettings(*SMALL_SIZE, SAMPLES_PER_SIDE), drawn)
    lens.use_dof = True
    _write(pixels, path)


def _write(pixels, path):
    offscreen.write_picture(pixels, path, bpy.context.scene)
    print(f"drawn: {path.name}", flush=True)


@contextmanager
def as_auburn(hair):
    """Auburn hair by the energy-conserving model, in a context."""
    look = hair.vellus.appearance
    before = look.mode, tuple(look.absorption), look.roughness, look.tip_absorption
    portrait.make_auburn(hair)
    try:
        yield
    finally:
        look.mode, look.absorption, look.roughness, look.tip_absorption = before


def draw_by_cycles(hair, path, sample_count):
    """Render the portrait by Cycles: the same scene, and the material that Vellus gives to hair."""
    width, height = portrait.SIZE
    with as_auburn(hair):
        bpy.context.view_layer.update()
        api.render(path, engine="cycles", width=width, height=height, sample_count=sample_count)


def draw_styled(hair, path):
    """Draw the same hair with a style preset, then restore it."""
    settings = hair.vellus.hair
    before = settings.point_count, settings.tip_taper
    api.apply_style_preset(hair, STYLE)
    bpy.context.view_layer.update()
    draw(read(), path)
    portrait.set_styles(hair)
    settings.point_count, settings.tip_taper = before
    bpy.context.view_layer.update()


def print_spline_table():
    """The report's first table: 200 curves of 6 control points to 41 points."""
    controls = np.random.default_rng(1).random((200, 6, 3))
    ways = {
        "recursion": lambda: bspline.evaluate_recursive(controls, np.linspace(0.0, 1.0, 41)),
        "subdivision": lambda: bspline.subdivide(controls, levels=3),
        "matrix": lambda: bspline.evaluate(controls, 41).numpy(),
    }
    print("\n200 curves, 6 control points, 41 points      report [ms]   here [ms]")
    for name, way in ways.items():
        way()  # compiles and fills caches
        best = min(_seconds(way) for _ in range(5))
        reported = REPORT_MILLISECONDS[name]
        print(f"  {name:42} {reported if reported else '-':>10}  {1e3 * best:10.3f}")


def print_frame_table(hair):
    """The report's second table: frames a second, one sample a pixel, shadow maps as they are from frame to frame."""
    print(f"\n1280 × 720 on {gpu.platform.renderer_get()}      report [frames/s]   here [frames/s]")
    hair.vellus.hair.strand_count = STRAND_COUNT
    with _head_and_hair_alone(hair):
        drawn = read()
        for label, model in MODELS.items():
            portrait.make_chestnut(hair, model)
            speed = _frames_per_second(with_look(drawn, hair))
            print(f"  {STRAND_COUNT:6} strands, {label:30} {REPORT_FRAMES[label]:>10} {speed:17.1f}")


@contextmanager
def _head_and_hair_alone(hair):
    """Hide all objects of the portrait but its head and hair, in a context."""
    others = [
        other
        for other in bpy.context.scene.objects
        if other.type in {"MESH", "CURVES"} and other.name != "Head" and other.data != hair and not other.hide_render
    ]
    for other in others:
        other.hide_render = True
    bpy.context.view_layer.update()
    try:
        yield
    finally:
        for other in others:
            other.hide_render = False


def _frames_per_second(drawn):
    bpy.context.scene.camera.data.sensor_fit = "VERTICAL"  # the frame shows all of the head
    pixel = gpu.types.GPUTexture((1, 1), format="RGBA16F")
    end = gpu.types.GPUFrameBuffer(color_slots=pixel)

    def draw(view, buffer):
        scene_drawing.draw(drawn, view, buffer, is_transparent=True)
        with end.bind():
            drawing.resolve(buffer.color, 1)
            end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")  # waits until the frame is drawn

    draw(*_view_and_buffer(64, 36))  # compiles and fills caches
    frame = _view_and_buffer(1280, 720)
    seconds, frame_count = _seconds(lambda: draw(*frame)), 20
    # Software drivers take seconds for a frame: a single frame is enough.
    return (
        1.0 / seconds if seconds > 0.5 else frame_count / _seconds(lambda: [draw(*frame) for _ in range(frame_count)])
    )


def _view_and_buffer(width, height):
    camera = scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), width, height)
    view = drawing.view_record(*camera, height, least_width=1.0)
    return view, visibility_buffer.VisibilityBuffer(width, height)


def _seconds(work):
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
