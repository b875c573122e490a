# SPDX-License-Identifier: GPL-3.0-or-later
"""make demo: the report's pictures and its two results tables, made on this machine.

Writes head.blend, kajiya_kay.png, marschner.png, dual_scattering.png, styled.png (the same hair, curly) and
tables/{m,n,n_trt}.exr to a folder. --cycles adds cycles.png, the scene of dual_scattering.png by Cycles, which takes
minutes; with --only-cycles there is nothing else.
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

import head  # beside this file
import portrait

import hair_addon
from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.gpu import drawing, visibility_buffer
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.core.geometry import bspline

STYLE = "CURLY"  # of styled.png
SAMPLES_PER_SIDE = 3  # of each pixel
PORTRAIT_SAMPLES_PER_SIDE = 4  # of dual_scattering.png
CYCLES_SAMPLES = 32  # and denoised, as Blender does unless told otherwise
MODELS = {"Kajiya-Kay": "KAJIYA_KAY", "Marschner": "MARSCHNER"}
REPORT_MILLISECONDS = {"recursion": 12.546, "subdivision": 5.653, "matrix": None}
REPORT_FRAMES = {("Marschner", 10_000): 25, ("Kajiya-Kay", 10_000): 36}


def main():
    """Make everything; the exit status is 0 only if all of it was made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/demo"))
    parser.add_argument("--cycles", action="store_true", help="also render the portrait by Cycles")
    parser.add_argument("--only-cycles", action="store_true", help="make no other picture and no table")
    options = parser.parse_args()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    started = time.perf_counter()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    head_object = head.build()
    portrait.dress(head_object)
    guides, hair = portrait.grow(head_object)
    portrait.light()
    print(f"{len(guides.data.curves)} guides, {len(hair.data.curves)} strands in {time.perf_counter() - started:.1f} s")
    bpy.context.view_layer.objects.active = hair
    if options.cycles or options.only_cycles:
        draw_by_cycles(hair.data, out / "cycles.png")
    if options.only_cycles:
        return
    bpy.ops.vellus.bake_tables(directory=str(out / "tables"))
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "head.blend"), compress=True)
    for model in MODELS.values():
        hair.data.vellus.model = model
        draw(out / f"{model.lower()}.png", has_blur=False)
    with as_auburn(hair.data):
        draw(out / "dual_scattering.png", samples_per_side=PORTRAIT_SAMPLES_PER_SIDE)
        draw_styled(hair.data, out / "styled.png")
    print_spline_table()
    portrait.undress(head_object)
    print_frame_table(guides, hair)
    print(f"\nmade in {time.perf_counter() - started:.1f} s: {out}")


def draw(path, has_blur=True, samples_per_side=SAMPLES_PER_SIDE):
    """Draw the portrait; has_blur: with depth of field, which takes a third longer."""
    width, height = portrait.SIZE
    bpy.context.scene.camera.data.dof.use_dof = has_blur
    bpy.ops.vellus.render_picture(filepath=str(path), width=width, height=height, samples_per_side=samples_per_side)


@contextmanager
def as_auburn(hair):
    """Auburn hair by the energy-conserving model, in a context."""
    look = hair.vellus.appearance
    before = look.mode, tuple(look.absorption), look.roughness
    look.mode, look.absorption, look.roughness = "energy", portrait.AUBURN, 0.25
    try:
        yield
    finally:
        look.mode, look.absorption, look.roughness = before


def draw_by_cycles(hair, path):
    """Render the portrait by Cycles: the same scene, and the material that Vellus gives to hair."""
    width, height = portrait.SIZE
    with as_auburn(hair):
        bpy.context.view_layer.update()
        api.render(path, engine="cycles", width=width, height=height, sample_count=CYCLES_SAMPLES)


def draw_styled(hair, path):
    """Draw the same hair with a style preset, and leave it as it was."""
    settings = hair.vellus.hair
    before = settings.point_count, settings.tip_taper
    api.apply_style_preset(hair, STYLE)
    bpy.context.view_layer.update()
    draw(path, has_blur=False)
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


def print_frame_table(guides, hair):
    """The report's second table: frames a second, one sample a pixel, shadow maps as they are from frame to frame."""
    print(f"\n1280 × 720 on {gpu.platform.renderer_get()}      report [frames/s]   here [frames/s]")
    for strand_count in (10_000, 30_000):
        bpy.context.view_layer.objects.active = guides
        hair.data.vellus.hair.strand_count = strand_count
        bpy.context.view_layer.update()
        drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
        for label, model in MODELS.items():
            hair.data.vellus.model = model
            (strands, _shading, *placed), *_ = drawn.hair
            shaded = replace(drawn, hair=[(strands, hair_cache.shading_of(hair.data), *placed)])
            reported = REPORT_FRAMES.get((label, strand_count), "-")
            print(f"  {strand_count:6} strands, {label:30} {reported:>10} {_frames_per_second(shaded):17.1f}")


def _frames_per_second(drawn, width=1280, height=720):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = scene.read_camera(bpy.context.scene, depsgraph, width, height)
    view = drawing.view_record(*camera, height, least_width=1.0)
    buffer = visibility_buffer.VisibilityBuffer(width, height)
    pixel = gpu.types.GPUTexture((1, 1), format="RGBA16F")
    end = gpu.types.GPUFrameBuffer(color_slots=pixel)

    def draw():
        with buffer.surfaces((0.0, 0.0, 0.0, 1.0)):
            drawn_scene.draw_surfaces(drawn, view)
        drawn_scene.draw_hair(drawn, view, buffer)
        with end.bind():
            drawing.resolve(buffer.color, 1)
            end.read_color(0, 0, 1, 1, 4, 0, "FLOAT")  # waits until the frame is drawn

    draw()  # compiles and fills caches
    seconds, frame_count = _seconds(draw), 20
    # Software drivers take seconds for a frame: one of them tells as much.
    return 1.0 / seconds if seconds > 0.5 else frame_count / _seconds(lambda: [draw() for _ in range(frame_count)])


def _seconds(work):
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
