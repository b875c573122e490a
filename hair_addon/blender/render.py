# SPDX-License-Identifier: GPL-3.0-or-later
"""The offscreen picture: the scene's meshes and hair, seen by its camera, drawn without a window."""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy
import gpu
import numpy as np

from ..core.errors import HairError
from ..core.long_work import Stage, run_now
from ..core.params import Settings, param
from . import drawing, drawn_scene, hair_buffer, scene


@dataclass(frozen=True)
class PictureSettings(Settings):
    """Size and quality of a picture."""

    width: int = param(1280, "Width of the picture in pixels", low=1, high=16384)
    height: int = param(720, "Height of the picture in pixels", low=1, high=16384)
    samples_per_side: int = param(
        4, "Samples along each side of a pixel: 4 gives 16 samples a pixel", label="Samples per side", low=1, high=8
    )
    is_transparent: bool = param(False, "Leave the background empty instead of filling it with the world's colour")


def draw_picture(settings):
    """(height, width, 4) float32 of the context's scene: scene-linear, premultiplied, first row at the bottom.

    Raises `HairError`.
    """
    return run_now(drawing_picture(settings))


def drawing_picture(settings):
    """`draw_picture` as work in stages (core/long_work.py), all of which run where the graphics are."""
    _start_gpu()
    samples = settings.samples_per_side
    width, height = settings.width * samples, settings.height * samples
    largest = gpu.capabilities.max_texture_size_get()
    if max(width, height) > largest:
        raise HairError(f"{width} × {height} samples do not fit this graphics driver's {largest}: use fewer.")
    yield Stage("Drawing shadows", 0.0)
    context = bpy.context
    depsgraph = context.evaluated_depsgraph_get()
    world_to_view, view_to_clip = scene.read_camera(context.scene, depsgraph, settings.width, settings.height)
    view = drawing.pass_record(world_to_view, view_to_clip, (width, height))
    drawn = drawn_scene.read(context.scene, context.view_layer, depsgraph)
    buffer = hair_buffer.HairBuffer(width, height)
    yield Stage("Drawing surfaces", 0.4)
    drawn_scene.draw_behind_hair(drawn, view, buffer, settings.is_transparent)
    yield Stage("Drawing hair", 0.5)
    drawn_scene.draw_hair(drawn, view, buffer)
    return _resolved(buffer, settings)


def _resolved(buffer, settings):
    """The means of a buffer's samples over pixels, as an array."""
    resolved = gpu.types.GPUTexture((settings.width, settings.height), format="RGBA32F")
    target = gpu.types.GPUFrameBuffer(color_slots=resolved)
    with target.bind():
        drawing.resolve(buffer.color, settings.samples_per_side)
        pixels = target.read_color(0, 0, settings.width, settings.height, 4, 0, "FLOAT")
    return np.array(pixels, np.float32).reshape(settings.height, settings.width, 4)


def _start_gpu():
    """In background Blender has no graphics until somebody asks."""
    if bpy.app.background:
        try:
            gpu.init()
        except SystemError as error:
            raise HairError(f"Nothing can be drawn here: this machine has no OpenGL driver ({error}).") from error


def write_picture(pixels, path, blender_scene):
    """Write a picture of `draw_picture` as PNG, through the scene's view transform, or as linear EXR.

    The file appears whole or not at all. Raises `HairError` for a folder that cannot be written or another format.
    """
    path = Path(path)
    formats = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32")}
    if path.suffix.lower() not in formats:
        raise HairError(f"A picture is written as .png or .exr, not as {path.suffix or 'a file without an ending'}.")
    file_format, color_depth = formats[path.suffix.lower()]
    height, width, _rgba = pixels.shape
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".vellus_") as folder:
            image = bpy.data.images.new("Vellus picture", width, height, alpha=True, float_buffer=True)
            try:
                image.alpha_mode = "PREMUL"
                image.pixels.foreach_set(pixels.ravel())
                image.file_format = file_format
                partial = os.path.join(folder, path.name)
                _save(image, partial, blender_scene, file_format, color_depth)
                os.replace(partial, path)
            finally:
                bpy.data.images.remove(image)
    except (OSError, RuntimeError) as error:
        raise HairError(f"{path} cannot be written: {error}. Pick a folder that you may write to.") from error


def _save(image, path, blender_scene, file_format, color_depth):
    """Save through a scene's view transform, with image settings of our own for the time it takes."""
    settings = blender_scene.render.image_settings
    # The kind first: which formats there are depends on it, and a scene may be set to write a film.
    wanted = {"media_type": "IMAGE", "file_format": file_format, "color_mode": "RGBA", "color_depth": color_depth}
    before = {name: getattr(settings, name) for name in wanted}
    try:
        _set(settings, wanted)
        image.save_render(path, scene=blender_scene)
    finally:
        _set(settings, before)


def _set(owner, values):
    for name, value in values.items():
        setattr(owner, name, value)
