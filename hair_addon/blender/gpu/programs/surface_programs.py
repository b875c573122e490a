# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that draw surfaces, and their inputs."""

import gpu

from . import scene_programs, uniforms
from .shaders import cached, compile_compute, compile_drawing

SEEN_SAMPLERS = ("visibility_x_y", "visibility_z")  # those of VISIBILITY_SAMPLERS that surfaces read
CORNER_SAMPLERS = ("places", "normals", "corners")  # of a `SurfaceOnGPU`
SURFACE_IMAGES = ("color_image", "roughness_image", "normal_image")  # of a `SurfaceMaterial`
_MATERIAL_SAMPLERS = (*SURFACE_IMAGES, "surface_albedo")


@cached
def number_program():
    """Return the program that draws a surface as samples of a picture: see visibility/triangle_index.vert."""
    info, varying = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("number_varying")
    scene_programs.declare_scene(info, shadow_samplers=(), is_lit=False)
    for slot, name in enumerate(CORNER_SAMPLERS):
        info.sampler(slot, "FLOAT_2D", name)
    info.push_constant("INT", "first_triangle")
    varying.flat("INT", "triangle")
    info.vertex_out(varying)
    return compile_drawing(
        info, "visibility/triangle_index.vert", "visibility/triangle_index.frag", (("segment", "UINT"),)
    )


SIDE = 4  # samples along each side of a thread's block: SIDE of shaders/surfaces/surface.comp


@cached
def shading_program():
    """Return the compute program that shades the samples where a surface is nearest: see surfaces/surface.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    for slot, name in enumerate(("segments", "depths"), start=_declare_material(info)):
        info.sampler(slot, "UINT_2D", name)
    info.image(0, scene_programs.PICTURE_FORMAT, "FLOAT_2D", "picture", qualifiers={"READ", "WRITE"})
    numbers = "first_triangle", "part_triangle", "triangle_count", "window_left", "window_bottom"
    for name in (*numbers, "row_stride", "is_coarse", "has_over"):
        info.push_constant("INT", name)
    return compile_compute(info, "surfaces/surface.comp")


@cached
def clear_program():
    """Return the program that draws a clear surface: see surfaces/clear_surface.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    _declare_material(info)
    info.vertex_out(_lit_varying())
    return compile_drawing(info, "surfaces/lit_surface.vert", "surfaces/clear_surface.frag")


@cached
def data_program():
    """Return the program of passes of data of a surface: see picture/surface_data.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    _declare_material(info, uniforms.DATA.source)
    info.uniform_buf(3, uniforms.DATA.type_name, "data")
    info.vertex_out(_lit_varying())
    return compile_drawing(info, "surfaces/lit_surface.vert", "picture/surface_data.frag")


@cached
def arrival_program(fragment, is_linked=False):
    """Return the program that measures the light on surfaces with a .frag; is_linked: draw linked surfaces as
    instances.
    """
    info = gpu.types.GPUShaderCreateInfo()
    first = _declare_lit(info, is_linked=is_linked)
    if is_linked:
        info.sampler(first, "FLOAT_2D", "transforms")
    info.vertex_out(_lit_varying())
    return compile_drawing(info, "surfaces/linked_lit.vert" if is_linked else "surfaces/lit_surface.vert", fragment)


@cached
def depth_program(fragment="shadows/shadow_surface.frag", is_clipped=False, is_linked=False):
    """Return the program that draws a surface into a shadow map, or as an occluder.

    is_clipped: apply clipping planes, as in surfaces/occluding_surface.frag; is_linked: draw linked surfaces as
    instances.
    """
    info, varying = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("surface_varying")
    replaced = scene_programs.declare_clipped_scene(info, (), is_clipped)
    info.sampler(0, "FLOAT_2D", "places")
    if is_linked:
        info.sampler(1, "FLOAT_2D", "transforms")
    varying.smooth("VEC3", "drawn_position")
    info.vertex_out(varying)
    vertex = "surfaces/linked_depth.vert" if is_linked else "surfaces/surface_depth.vert"
    return compile_drawing(info, vertex, fragment, replaced=replaced)


def _declare_material(info, structs=""):
    """Declare the inputs of shading programs; returns the first free sampler slot."""
    info.uniform_buf(2, "Surface", "surface")
    return _declare_lit(info, uniforms.SURFACE.source + structs, _MATERIAL_SAMPLERS)


def _declare_lit(info, structs="", samplers=(), is_linked=False):
    scene_programs.declare_scene(info, structs, is_lit=False)
    names, first = (*SEEN_SAMPLERS, *CORNER_SAMPLERS, *samplers), len(scene_programs.SHADOW_SAMPLERS)
    for slot, name in enumerate(names, start=first):
        info.sampler(slot, "FLOAT_2D_ARRAY" if is_linked and name in SEEN_SAMPLERS else "FLOAT_2D", name)
    return first + len(names)


def _lit_varying():
    varying = gpu.types.GPUStageInterfaceInfo("surface_varying")
    for kind, name in (
        ("VEC3", "drawn_position"),
        ("VEC3", "surface_normal"),
        ("VEC4", "corner_seen_x_y"),
        ("VEC4", "corner_seen_z"),
        ("VEC2", "surface_uv"),
    ):
        varying.smooth(kind, name)
    return varying
