# SPDX-License-Identifier: GPL-3.0-or-later
"""A film of moving hair: baked by the command `simulate`, rendered with motion blur by the command `render`.

Writes film.blend, frames/film_####.png and film.mp4. Both commands go on where they stopped.
"""

import math
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

from blend_samples.dynamics import dynamics_scene
from hair_addon.core.files.atomic_file import atomic_file

ROOT = Path(__file__).resolve().parents[2]
LAST = 40  # frame
SIZE = 240, 288  # pixels
SAMPLE_COUNT, MOTION_STEPS = 4, 3  # of a pixel, and moments while the shutter is open
STRAND_COUNT, RADIUS = 8000, 1.9e-4  # [m]: fewer and thicker strands, as the film is small
TURNS, TURN_SECONDS = ((0.1, -40.0), (0.7, 40.0)), 0.4  # (second, degrees)


def make(head_file, out):
    """Make the film in a folder, from the file of the head; the exit status of the command that failed, or 0."""
    film = out / "film.blend"
    if not film.exists():  # another file would be another film
        _build(head_file, film)
    pattern = out / "frames" / "film_####.png"
    for words in (
        ["simulate", str(film)],
        ["render", str(film), "--frames", "all", "--out", str(pattern), "--samples", str(SAMPLE_COUNT)],
    ):
        print("python -m hair_addon", *words, flush=True)
        status = subprocess.run([sys.executable, "-m", "hair_addon", *words], cwd=ROOT, check=False).returncode
        if status:
            return status
    _join([pattern.with_name(f"film_{frame:04}.png") for frame in range(1, LAST + 1)], out / "film.mp4")
    print(out / "film.mp4", flush=True)
    return 0


def turned(time):
    """Return the head's angle [radians] at a time [s]: to the side, and back."""
    angle = 0.0
    for start, degrees in TURNS:
        part = float(np.clip((time - start) / TURN_SECONDS, 0.0, 1.0))
        angle += math.radians(degrees) * part**2 * (3.0 - 2.0 * part)
    return angle


def prepare():
    """Let the head of the open file turn to the side and back, and its hair simulate, to be baked beside the file."""
    skull, guides, _hair = dynamics_scene.objects()
    dynamics_scene.turn(skull, 2, turned, LAST + 1)
    guides.data.vellus.cache_folder = "//haircache"
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = dynamics_scene.FIRST, LAST
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5


def _build(head_file, path):
    bpy.ops.wm.open_mainfile(filepath=str(head_file))
    prepare()
    bpy.context.scene.vellus.motion_steps = MOTION_STEPS
    hair = dynamics_scene.objects()[2].data.vellus.hair
    hair.strand_count, hair.radius = STRAND_COUNT, RADIUS
    bpy.context.view_layer.update()
    with atomic_file(path) as partial:
        bpy.ops.wm.save_as_mainfile(filepath=str(partial), compress=True, copy=True)


def _join(pictures, path):
    """Write pictures, one a frame, as a film."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    editor = scene.sequence_editor_create()
    strip = editor.strips.new_image("Film", str(pictures[0]), 1, 1)
    for picture in pictures[1:]:
        strip.elements.append(picture.name)
    strip.frame_final_duration = len(pictures)
    scene.frame_start, scene.frame_end = 1, len(pictures)
    render = scene.render
    render.fps, render.fps_base, render.resolution_percentage = dynamics_scene.RATE, 1.0, 100
    render.resolution_x, render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"  # pictures have their view transform already
    render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec, render.ffmpeg.constant_rate_factor = "MPEG4", "H264", "HIGH"
    render.filepath, render.use_file_extension = str(path), False
    bpy.ops.render.render(animation=True)
