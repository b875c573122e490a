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
from ..core.params import Settings, param
from . import drawing, hair_cache, scene, shadows


@dataclass(frozen=True)
class PictureSettings(Settings):
    """Size and quality of a picture."""

    width: int = param(1280, "Width of the picture in pixels", low=1, high=16384)
    height: int = param(720, "Height of the picture in pixels", low=1, high=16384)
    samples_per_side: int = param(
        4, "Samples along each side of a pixel: 4 gives 16 samples a pixel", label="Samples per side", low=1, high=8
    )
    is_transparent: bool = param(False, "Leave the background empty instead of filling it with the world's colour")


def draw_picture(blender_scene, view_layer, depsgraph, settings):
    """(height, width, 4) float32: scene-linear, premultiplied, first row at the bottom. Raises `HairError`."""
    samples = settings.samples_per_side
    width, height = settings.width * samples, settings.height * samples
    largest = gpu.capabilities.max_texture_size_get()
    if max(width, height) > largest:
        raise HairError(f"{width} × {height} samples do not fit this graphics driver's {largest}: use fewer.")
    world_to_view, view_to_clip = scene.read_camera(blender_scene, depsgraph, settings.width, settings.height)
    view = drawing.view_record(world_to_view, view_to_clip, height)
    radiance = scene.read_world_radiance(blender_scene)
    view["world_radiance"][:3] = radiance
    lights = scene.read_lights(depsgraph)
    background = (0.0, 0.0, 0.0, 0.0) if settings.is_transparent else (*radiance, 1.0)

    hair = [
        (*hair_cache.hair_on_gpu(o.data), np.array(o.matrix_world, np.float64))
        for o in scene.curves_objects(view_layer, "HAIR")
    ]
    surfaces = [
        (drawing.upload_surface(mesh.positions, mesh.normals), mesh.color)
        for mesh in scene.read_render_meshes(depsgraph)
    ]
    shadow_maps = shadows.ShadowMaps()
    shadow_maps.draw(lights, [(strands, to_world) for strands, _, to_world in hair], [batch for batch, _ in surfaces])
    if hair:
        view["hair_forward"][:3] = hair[0][1].forward

    color = gpu.types.GPUTexture((width, height), format="RGBA16F")
    depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=color, depth_slot=depth)
    with framebuffer.bind(), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        framebuffer.clear(color=background, depth=1.0)
        for batch, surface_color in surfaces:
            drawing.draw_surface(batch, surface_color, view, lights, shadow_maps.samplers)
        # Strands overlap many times: their depth goes first, so that only what stays visible is shaded.
        for strands, _shading, to_world in hair:
            drawing.draw_strands(strands, drawing.depth_only(), view, lights, to_world)
        for strands, shading, to_world in hair:
            drawing.draw_strands(strands, shading, view, lights, to_world, shadow_maps.samplers)
    resolved = gpu.types.GPUTexture((settings.width, settings.height), format="RGBA32F")
    target = gpu.types.GPUFrameBuffer(color_slots=resolved)
    with target.bind():
        drawing.resolve(color, samples)
        pixels = target.read_color(0, 0, settings.width, settings.height, 4, 0, "FLOAT")
    return np.array(pixels, np.float32).reshape(settings.height, settings.width, 4)


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
    before = settings.file_format, settings.color_mode, settings.color_depth
    try:
        settings.file_format, settings.color_mode, settings.color_depth = file_format, "RGBA", color_depth
        image.save_render(path, scene=blender_scene)
    finally:
        settings.file_format, settings.color_mode, settings.color_depth = before
