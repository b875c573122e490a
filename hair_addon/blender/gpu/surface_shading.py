# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing of lit surfaces, each material with its images."""

import math

import gpu
import numpy as np

from ...core.shading.tables import surface_albedo
from ..data.pictures import surface_bakes
from ..host.caches import Cache
from . import drawing, windows
from .programs import scene_programs, surface_programs, uniforms

texture_cache = Cache()  # textures shared by all surfaces
baked_cache = Cache(capacity=16)  # `BakedPicture` → texture, of 8 to 32 MB


def shade(surface, parts, first_triangle, view, lights, samplers, buffer, picture, has_over):
    """Shade the samples of a picture in which a `SurfaceOnGPU` is nearest.

    parts: (first corner, number of corners, `SurfaceMaterial`), ...; first_triangle: the surface's first triangle in
    the numbers of a `VisibilityBuffer`; view, lights: records of `uniforms`; samplers: {sampler: texture} of shadows
    and of the world's visibility; picture: the texture to fill; has_over: whether it already contains what is drawn
    over surfaces.
    """
    placed, program = surface.placed(view), surface_programs.shading_program()
    blocks = {"view": uniforms.uniform_buffer(placed), "lights": uniforms.uniform_buffer(lights)}
    to_clip = (placed["object_to_world"].astype(np.float64) @ placed["world_to_clip"]).T
    samplers = surface.samplers | samplers | {"segments": buffer.segments, "depths": buffer.nearest_depths()}
    constants = {"is_coarse": int(buffer.is_coarse), "has_over": int(has_over), "first_triangle": first_triangle}
    for first, count, material in parts:
        left, bottom, *size = windows.of_box(surface.bounds_of(first, count), to_clip, buffer.size)
        if not all(size):
            continue
        constants |= {"part_triangle": first // 3, "triangle_count": count // 3}
        constants |= {"window_left": left, "window_bottom": bottom}
        with drawing.bound(program, blocks, samplers | _of_material(blocks, material)):
            # One thread more, as the first may begin before the window.
            threads = [length // surface_programs.SIDE + 2 for length in size]
            constants["row_stride"] = stride_over(-(-threads[1] // scene_programs.PICTURE_GROUP_SIZE))
            program.image("picture", picture)
            for name, value in constants.items():
                program.uniform_int(name, value)
            drawing.dispatch_over(program, threads)


def stride_over(count):
    """Return the least stride, from the golden section of `count` on, that visits each of `count` rows once,
    wrapping around.

    Consecutively visited rows are spread over all rows.
    """
    stride = math.ceil(0.618 * count)
    while math.gcd(stride, count) > 1:
        stride += 1
    return stride


def draw_clear(surface, parts, view, lights, samplers):
    """Draw a clear `SurfaceOnGPU` into the bound framebuffer; samplers: of shadows and of the world's visibility."""
    blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "lights": uniforms.uniform_buffer(lights)}
    program = surface_programs.clear_program()
    for first, count, material in parts:
        with drawing.bound(program, blocks, surface.samplers | samplers | _of_material(blocks, material)):
            surface.corners.bare.draw_range(program, elem_start=first, elem_count=count)


def draw_data(surface, parts, view, lights, samplers, record):
    """Draw a pass of data of a `SurfaceOnGPU` into the bound framebuffer; record: of `uniforms.DATA`."""
    blocks = {"view": uniforms.uniform_buffer(surface.placed(view)), "lights": uniforms.uniform_buffer(lights)}
    blocks["data"] = uniforms.uniform_buffer(record)
    program = surface_programs.data_program()
    for first, count, material in parts:
        with drawing.bound(program, blocks, surface.samplers | samplers | _of_material(blocks, material)):
            surface.corners.bare.draw_range(program, elem_start=first, elem_count=count)


def _of_material(blocks, material):
    """Return {sampler: texture} of a material; adds its block to `blocks`."""
    images = {name: _texture(getattr(material, name)) for name in surface_programs.SURFACE_IMAGES}
    blocks["surface"] = uniforms.uniform_buffer(_record(material, images))
    images = {name: white() if texture is None else texture for name, texture in images.items()}
    return {"surface_albedo": _albedo_texture(), **images}


def _texture(image_map):
    """Blender's texture of an image, which Blender may replace at any time; None if it cannot be read."""
    if image_map is None:
        return None
    try:
        is_baked = isinstance(image_map.image, surface_bakes.BakedPicture)
        texture = _baked_texture(image_map.image) if is_baked else gpu.texture.from_image(image_map.image)
    except RuntimeError:  # the file was removed after the scene was read
        return None
    texture.extend_mode(image_map.extension)
    texture.filter_mode(image_map.is_smooth)
    texture.anisotropic_filter(False)  # blurs with software drivers
    return texture


@baked_cache.keeping
def _baked_texture(picture):
    texels = np.ascontiguousarray(picture.texels)
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture(texels.shape[1::-1], format="RGBA16F", data=data)


@texture_cache.keeping
def white():
    """Return a texture for samplers that are not read."""
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
    for name in ("roughness", "metallic", "reflectance", "normal_strength"):
        record[name] = getattr(material, name)
    for index, name in enumerate(surface_programs.SURFACE_IMAGES):
        record[f"has_{name}"] = images[name] is not None
        if images[name] is not None:
            record["image_rows"][2 * index : 2 * index + 2, :3] = getattr(material, name).rows
    record["is_color_opaque"] = material.color_image is None or material.color_image.is_opaque
    if material.roughness_image is not None:
        record["roughness_channels"] = material.roughness_image.channels
    return record
