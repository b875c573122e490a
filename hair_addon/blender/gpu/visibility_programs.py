# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that prepare a visibility buffer for the strands that are drawn into it."""

import gpu

from . import scene_programs, shaders

RUNS_IN_ROW = 16384  # RUNS_IN_ROW of shaders/strand_segments.comp
LEAST_BEND = 1.0  # [samples]: LEAST_BEND of shaders/include/walk_segment.glsl
TILE = 8  # samples along each side of a tile: TILE of shaders/include/tile.glsl


@shaders.kept
def farthest_depths_program():
    """The compute program that finds the farthest depth in each tile: see farthest_depths.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.sampler(0, "UINT_2D", "depths")
    info.image(0, "R32UI", "UINT_2D", "farthest_depths", qualifiers={"WRITE"})
    return shaders.compile_compute(info, "farthest_depths.comp")


@shaders.kept
def hair_first_program():
    """The program of depths that leave surfaces behind hair out: see hair_first.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.sampler(0, "UINT_2D", "segments")
    info.depth_write("ANY")
    return shaders.compile_drawing(info, "cover.vert", "hair_first.frag")


@shaders.kept
def fill_program():
    """The compute program that fills a picture with a color: see fill.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.image(0, scene_programs.PICTURE_FORMAT, "FLOAT_2D", "picture", qualifiers={"WRITE"})
    info.push_constant("VEC4", "fill_color")
    return shaders.compile_compute(info, "fill.comp")


@shaders.kept
def no_triangle_program():
    """The program that empties a visibility buffer's samples: see no_triangle.frag."""
    return shaders.compile_drawing(
        gpu.types.GPUShaderCreateInfo(), "cover.vert", "no_triangle.frag", (("segment", "UINT"),)
    )


@shaders.kept
def surface_blank_program():
    """The program that empties samples of surfaces: see surface_blank.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.sampler(0, "UINT_2D", "segments")
    return shaders.compile_drawing(info, "cover.vert", "surface_blank.frag")


@shaders.kept
def surface_depths_program():
    """The compute program that converts depth to integers, and clears all else: see surface_depths.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "surface_depth")
    for slot, name in enumerate(("depths", "segments")):
        info.image(slot, "R32UI", "UINT_2D", name, qualifiers={"WRITE"})
    info.image(2, scene_programs.PICTURE_FORMAT, "FLOAT_2D", "picture", qualifiers={"WRITE"})
    for name in ("is_start", "is_blank"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "surface_depths.comp")
