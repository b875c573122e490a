# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that prepare a visibility buffer."""

import gpu

from . import scene_programs, shaders

RUNS_IN_ROW = 16384  # RUNS_IN_ROW of shaders/visibility/strand_segments.comp
LEAST_BEND = 1.0  # [samples]: LEAST_BEND of shaders/visibility/rasterize_segment.glsl
TILE = 8  # samples along each side of a tile: TILE of shaders/visibility/tile.glsl


@shaders.cached
def farthest_depths_program():
    """Return the compute program that finds the farthest depth in each tile: see visibility/farthest_depths.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.sampler(0, "UINT_2D", "depths")
    info.image(0, "R32UI", "UINT_2D", "farthest_depths", qualifiers={"WRITE"})
    return shaders.compile_compute(info, "visibility/farthest_depths.comp")


@shaders.cached
def hair_first_program():
    """Return the program that excludes surfaces behind hair by depth: see surfaces/hair_in_front.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.sampler(0, "UINT_2D", "segments")
    info.depth_write("ANY")
    return shaders.compile_drawing(info, "picture/cover.vert", "surfaces/hair_in_front.frag")


@shaders.cached
def fill_program():
    """Return the compute program that fills a picture with a color: see picture/fill.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.image(0, scene_programs.PICTURE_FORMAT, "FLOAT_2D", "picture", qualifiers={"WRITE"})
    info.push_constant("VEC4", "fill_color")
    return shaders.compile_compute(info, "picture/fill.comp")


@shaders.cached
def no_triangle_program():
    """Return the program that clears a visibility buffer's samples: see visibility/clear_samples.frag."""
    return shaders.compile_drawing(
        gpu.types.GPUShaderCreateInfo(), "picture/cover.vert", "visibility/clear_samples.frag", (("segment", "UINT"),)
    )


@shaders.cached
def surface_blank_program():
    """Return the program that blanks samples of surfaces: see surfaces/surface_blank.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.sampler(0, "UINT_2D", "segments")
    return shaders.compile_drawing(info, "picture/cover.vert", "surfaces/surface_blank.frag")


@shaders.cached
def surface_depths_program():
    """Return the compute program that converts depths to integers, and clears images: see
    visibility/surface_depths.comp.
    """
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "surface_depth")
    for slot, name in enumerate(("depths", "segments")):
        info.image(slot, "R32UI", "UINT_2D", name, qualifiers={"WRITE"})
    info.image(2, scene_programs.PICTURE_FORMAT, "FLOAT_2D", "picture", qualifiers={"WRITE"})
    for name in ("is_start", "is_blank"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "visibility/surface_depths.comp")
