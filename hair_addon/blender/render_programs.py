# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → the GPU programs that only renders need."""

from functools import cache

import gpu

from . import shaders

FILM_FORMAT = "RGBA32F"  # of sums of samples


@cache
def film_program():
    """The compute program that adds the samples of `picture` to a film: see film.comp."""
    return _film("film.comp", (("picture", "FLOAT_2D"),))


@cache
def film_depth_program():
    """The same of what is no light: see film_depth.comp."""
    samplers = (("segments", "UINT_2D"), ("depths", "UINT_2D"), ("surface_depth", "FLOAT_2D"))
    return _film("film_depth.comp", samplers, (("VEC4", "view_to_clip"),))


def _film(file, samplers, constants=()):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(shaders.PICTURE_GROUP_SIZE, shaders.PICTURE_GROUP_SIZE)
    for slot, (name, kind) in enumerate(samplers):
        info.sampler(slot, kind, name)
    for kind, name in (("INT", "samples_per_side"), *constants):
        info.push_constant(kind, name)
    info.image(0, FILM_FORMAT, "FLOAT_2D", "sums", qualifiers={"READ", "WRITE"})
    return shaders.compile_compute(info, file)


@cache
def strand_arrival_program():
    """The compute program that says how much light arrives at strands: see strand_arrival.comp."""
    return shaders.compile_compute(shaders.strand_samples_info(), "strand_arrival.comp")


@cache
def surface_arrival_program():
    """The same of a surface: see surface_arrival.frag."""
    info, varying = shaders.surface_info()
    shaders.declare_scene(info, is_lit=False)
    info.vertex_out(varying)
    return shaders.compile_drawing(info, "surface.vert", "surface_arrival.frag")


@cache
def film_view_program():
    """The program that shows the mean of a film: see film_view.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("VEC2", "origin")  # [pixels] of the film in the framebuffer
    info.push_constant("FLOAT", "sample_count")
    info.sampler(0, "FLOAT_2D", "sums")
    return shaders.compile_drawing(info, "cover.vert", "film_view.frag")
