# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing of lit surfaces, each material with its images."""

import gpu
import numpy as np

from ...core.shading.tables import surface_albedo
from ..host.caches import Cache
from . import drawing, scene_programs, uniforms

texture_cache = Cache()  # of the textures that all surfaces are drawn with


def draw(surface, parts, view, lights, scene_samplers):
    """Draw a `SurfaceOnGPU` into the bound framebuffer.

    parts: (first corner, number of corners, `SurfaceMaterial`), ...; view, lights: records of `uniforms`;
    scene_samplers: {sampler: texture} of shadows and of the world's visibility.
    """
    blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "lights": uniforms.uniform_buffer(lights)}
    program = scene_programs.surface_program()
    for first, count, material in parts:
        images = {name: _texture(getattr(material, name)) for name in scene_programs.SURFACE_IMAGES}
        blocks["surface"] = uniforms.uniform_buffer(_record(material, images))
        samplers = {"surface_albedo": _albedo_texture()}
        samplers |= {name: _white() if texture is None else texture for name, texture in images.items()}
        with drawing.bound(program, blocks, surface.samplers | scene_samplers | samplers):
            surface.corners.lit.draw_range(program, elem_start=first, elem_count=count)


def _texture(image_map):
    """Blender's own texture of an image, which it may replace at any time: None of one that cannot be read."""
    if image_map is None:
        return None
    try:
        texture = gpu.texture.from_image(image_map.image)
    except RuntimeError:  # its file is gone since the scene was read
        return None
    texture.extend_mode(image_map.extension)
    texture.filter_mode(image_map.is_smooth)
    texture.anisotropic_filter(False)  # software drivers blur by it
    return texture


@texture_cache.keeping
def _white():
    """A texture for samplers that are not read."""
    return gpu.types.GPUTexture((1, 1), format="RGBA8")


@texture_cache.keeping
def _albedo_texture():
    table = surface_albedo.table()
    data = gpu.types.Buffer("FLOAT", table.size, np.ascontiguousarray(table).ravel())
    texture = gpu.types.GPUTexture(table.shape[1::-1], format="RGBA16F", data=data)
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def _record(material, images):
    record = uniforms.SURFACE.record()
    record["color"][:3] = material.color
    for name in ("roughness", "metallic", "reflectance", "normal_strength", "is_clear"):
        record[name] = getattr(material, name)
    for index, name in enumerate(scene_programs.SURFACE_IMAGES):
        record[f"has_{name}"] = images[name] is not None
        if images[name] is not None:
            record["image_rows"][2 * index : 2 * index + 2, :3] = getattr(material, name).rows
    if material.roughness_image is not None:
        record["roughness_channels"] = material.roughness_image.channels
    return record
