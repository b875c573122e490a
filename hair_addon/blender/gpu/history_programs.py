# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs of a viewport's history."""

import gpu

from . import shaders, uniforms

BLOCK_SIDE = 8  # pixels: BLOCK_SIDE of shaders/picture/history_blocks.glsl


@shaders.cached
def blocks_program():
    """The program for the mean and deviation of each block of pixels: see picture/history_blocks.frag."""
    return _filter("picture/history_blocks.frag", ("picture",), (("mean", "VEC4"), ("deviation", "VEC4")), ("weight",))


@shaders.cached
def carry_program():
    """The program that reprojects the previous picture: see picture/history_carry.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.HISTORY.source)
    info.uniform_buf(0, "History", "history")
    of_blocks = ("before_mean", "before_deviation", "now_mean", "now_deviation")
    for slot, name in enumerate(("depths", "segments")):
        info.sampler(slot, "UINT_2D", name)
    of_light = ("light_before", "light_now")
    for slot, name in enumerate(("before", "before_passes", *of_blocks, "motion", *of_light), start=2):
        info.sampler(slot, "FLOAT_2D", name)
    return shaders.compile_drawing(info, "picture/history_carry.vert", "picture/history_carry.frag", _PICTURE)


@shaders.cached
def mix_program():
    """The program that blends reprojected pixels with the passes so far: see picture/history_mix.frag."""
    samplers = ("sums", "carried", "carried_passes")
    return _filter("picture/history_mix.frag", samplers, _PICTURE, ("weight", "pass_count", "part_left"))


_PICTURE = (("color", "VEC4"), ("passes", "FLOAT"))


def _filter(fragment, samplers, targets, constants):
    info = gpu.types.GPUShaderCreateInfo()
    for name in constants:
        info.push_constant("FLOAT", name)
    for slot, name in enumerate(samplers):
        info.sampler(slot, "FLOAT_2D", name)
    return shaders.compile_drawing(info, "picture/cover.vert", fragment, targets)
