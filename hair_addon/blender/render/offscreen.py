# SPDX-License-Identifier: GPL-3.0-or-later
"""Offscreen picture: the scene's meshes and hair from its camera, without a window."""

from pathlib import Path

import bpy
import gpu

from ...core.errors import HairError
from ...core.files.atomic_file import atomic_file
from ...core.imaging import pixel_sampling
from ...core.imaging.pixel_sampling import MOST_DRAWN
from ...core.long_work import Stage, run_now
from ..data import scene
from ..data.pictures import cameras
from ..gpu import drawing, world_texture
from ..groom.dynamics import frame_folders
from ..host import scene_time
from . import drawn_scene, film, light_paths


def draw_picture(settings, drawn=None, lens_passes=None):
    """Return (height, width, 4) float32 of the context's scene: scene-linear, premultiplied, bottom row first.

    settings: `PictureSettings` without `FRAME_FIELDS`; drawn: the `DrawnScene` of the context's scene, None: read here;
    lens_passes: with depth of field, the minimum number of points on the lens, None: one for each sample. Raises
    `HairError`.
    """
    return run_now(drawing_picture(settings, drawn, lens_passes))


def drawing_picture(settings, drawn=None, lens_passes=None):
    """`draw_picture` as work in stages (core/long_work.py), which must all run in the thread of the GPU context."""
    if max(settings.width, settings.height) > MOST_DRAWN:
        raise HairError(
            f"{settings.width} × {settings.height} pixels exceed {MOST_DRAWN} a side: use fewer, or render a frame."
        )
    start_gpu()
    context = bpy.context
    depsgraph = scene.present_depsgraph()
    lens = cameras.read_lens(context.scene, depsgraph)
    per_side, pass_count = settings.samples_per_side, 1
    if lens is not None:  # one pass per point on the lens
        sample_count = per_side**2
        per_side = pixel_sampling.samples_per_side(sample_count, lens_passes or sample_count)
        pass_count = sample_count // per_side**2
    width, height = size = settings.width, settings.height
    filter_width = pixel_sampling.FILTER_WINDOW * context.scene.render.filter_size
    largest = gpu.capabilities.max_texture_size_get()
    if max(size) * per_side + 2 * (film.BORDER + pixel_sampling.filter_margin(per_side, filter_width)) > largest:
        sentence = f"{width * per_side} × {height * per_side} samples exceed the graphics driver's {largest} a side"
        raise HairError(f"{sentence}: use fewer.")
    if drawn is None:
        frame_folders.require_readable([scene_time.frame_of(context.scene)], context.scene)
    yield Stage("Drawing shadows", 0.0)
    world_texture.check_image()
    if context.scene.camera is not None and cameras.is_panoramic(context.scene.camera):
        raise HairError("Pictures are drawn by perspective and orthographic cameras: render a frame instead.")
    camera = scene.read_camera(context.scene, depsgraph, width, height)
    if drawn is None:
        drawn = drawn_scene.read(context.scene, context.view_layer, depsgraph)
    drawn = light_paths.with_grid(drawn, *camera, light_paths.path_count(context.scene, size))
    picture = film.Film(size, per_side, ("Combined",), settings.is_transparent, filter_width)
    for turn in range(pass_count):
        yield Stage("Drawing", 0.4 + 0.55 * turn / pass_count)
        with drawing.ALONE:
            picture.add_pass(drawn, *camera, size, turn, lens=lens)
    return picture.read()["Combined"]


def start_gpu():
    """Initialize the GPU, which Blender does not do in background mode. Raises `HairError` if drawing is impossible."""
    if bpy.app.background:
        try:
            gpu.init()
        except SystemError as error:
            raise HairError(f"Drawing is not possible: this machine has no OpenGL driver ({error}).") from error
    try:
        gpu.types.GPUTexture((1, 1), format="R32F")
    except RuntimeError as error:
        sentence = "Drawing is not possible while Blender renders: draw before the render, or after it has ended."
        raise HairError(sentence) from error


def write_picture(pixels, path, blender_scene):
    """Write a picture of `draw_picture` as PNG, through the scene's view transform, or as linear EXR.

    The file is written completely or not at all. Raises `HairError` for other formats, or if it cannot be written.
    """
    path = Path(path)
    formats = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32")}
    if path.suffix.lower() not in formats:
        raise HairError(f"Pictures are saved as .png or .exr, not as {path.suffix or 'a file without an extension'}.")
    file_format, color_depth = formats[path.suffix.lower()]
    height, width, _rgba = pixels.shape
    with atomic_file(path) as partial:
        image = bpy.data.images.new("Vellus picture", width, height, alpha=True, float_buffer=True)
        try:
            image.alpha_mode = "PREMUL"
            image.pixels.foreach_set(pixels.ravel())
            image.file_format = file_format
            _save(image, str(partial), blender_scene, file_format, color_depth)
        finally:
            bpy.data.images.remove(image)


def _save(image, path, blender_scene, file_format, color_depth):
    """Save through a scene's view transform, with temporary image settings."""
    settings = blender_scene.render.image_settings
    # The media type first: the available formats depend on it, and a scene may be set to write a movie.
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
