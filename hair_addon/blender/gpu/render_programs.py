# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs of the render engine."""

import gpu

from . import scene_programs, shaders, uniforms

FILM_FORMAT = "RGBA32F"  # of sums of samples


@shaders.cached
def film_program():
    """The compute program that adds the samples of `picture` to a film: see picture/film.comp."""
    return _film("picture/film.comp", (("picture", "FLOAT_2D"),))


@shaders.cached
def film_depth_program():
    """The compute program that adds data passes to a film: see picture/film_depth.comp."""
    samplers = (("segments", "UINT_2D"), ("depths", "UINT_2D"))
    return _film("picture/film_depth.comp", samplers, (("VEC4", "view_to_clip"),))


def _film(file, samplers, constants=()):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    for slot, (name, kind) in enumerate((("filter_weights", "FLOAT_2D"), *samplers)):
        info.sampler(slot, kind, name)
    for kind, name in (*(("INT", name) for name in ("samples_per_side", "margin", "border")), *constants):
        info.push_constant(kind, name)
    info.image(0, FILM_FORMAT, "FLOAT_2D", "sums", qualifiers={"READ", "WRITE"})
    return shaders.compile_compute(info, file)


@shaders.cached
def strand_arrival_program():
    """The compute program of light visibility from strands: see light/strand_irradiance.comp."""
    return shaders.compile_compute(scene_programs.strand_samples_info(), "light/strand_irradiance.comp")


MOTION_FORMAT = "RGBA32F"  # of motion vectors


@shaders.cached
def strand_motion_program():
    """The compute program of motion vectors of strands: see picture/strand_motion.comp."""
    names = ("strands_before", "strands_after", "moved_rows", "moved_points")
    samplers = tuple((name, "FLOAT_2D") for name in names)
    info = scene_programs.strand_samples_info(uniforms.MOTION.source, samplers, MOTION_FORMAT)
    info.uniform_buf(2, "Motion", "motion")
    return shaders.compile_compute(info, "picture/strand_motion.comp")


@shaders.cached
def surface_motion_program():
    """The program of motion vectors of surfaces: see picture/surface_motion.vert."""
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.VIEW.source + uniforms.MOTION.source)
    info.uniform_buf(0, "View", "view")
    info.uniform_buf(1, "Motion", "motion")
    for slot, name in enumerate(("places", "places_before", "places_after")):
        info.sampler(slot, "FLOAT_2D", name)
    varying = gpu.types.GPUStageInterfaceInfo("motion_varying")
    for name in ("place_now", "place_before", "place_after"):
        varying.smooth("VEC4", name)
    info.vertex_out(varying)
    return shaders.compile_drawing(info, "picture/surface_motion.vert", "picture/surface_motion.frag")


@shaders.cached
def film_view_program():
    """The program that shows the mean of a film: see picture/film_view.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("VEC2", "origin")  # [pixels] of the film in the framebuffer
    info.push_constant("FLOAT", "weight_sum")
    info.sampler(0, "FLOAT_2D", "sums")
    return shaders.compile_drawing(info, "picture/cover.vert", "picture/film_view.frag")
