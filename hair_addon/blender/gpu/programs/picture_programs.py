# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs of a viewport's history."""

import gpu

from . import scene_programs, shaders, uniforms

FILM_FORMAT = "RGBA32F"  # of sums of samples


@shaders.cached
def film_program():
    """Return the compute program that adds the samples of `picture` to a film: see picture/film.comp."""
    return _film("picture/film.comp", (("picture", "FLOAT_2D"),))


@shaders.cached
def film_depth_program():
    """Return the compute program that adds data passes to a film: see picture/film_depth.comp."""
    samplers = (("segments", "UINT_2D"), ("depths", "UINT_2D"))
    return _film("picture/film_depth.comp", samplers, (("VEC4", "view_to_clip"),))


@shaders.cached
def film_position_program():
    """Return the compute program of the nearest position in each pixel: see picture/film_position.comp."""
    samplers = (("picture", "FLOAT_2D"), ("depths", "UINT_2D"))
    return _film("picture/film_position.comp", samplers, (("VEC4", "view_to_clip"),))


@shaders.cached
def film_mattes_program():
    """Return the compute program that adds the coverage of pixels by labels: see picture/film_mattes.comp."""
    samplers = (("segments", "UINT_2D"), ("matte_ranges", "FLOAT_2D"))
    names = ("range_count", "range_columns", "slot_count", "layer_columns", "tile_width", "tile_height")
    return _film("picture/film_mattes.comp", samplers, tuple(("INT", name) for name in names))


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
    """Return the compute program of light visibility from strands: see light/strand_irradiance.comp."""
    return shaders.compile_compute(scene_programs.strand_samples_info(), "light/strand_irradiance.comp")


MOTION_FORMAT = "RGBA32F"  # of motion vectors
CARRIED_MOTION_FORMAT = "RG32F"  # of motion vectors to the previous frame alone


@shaders.cached
def strand_motion_program(is_batch=False, is_nearest=False):
    """Return the compute program of motion vectors of strands: see picture/strand_motion.comp.

    is_batch: for linked hair, with the sampler of picture/batch_motion.glsl; is_nearest: to the previous frame alone,
    for the nearest sample of each pixel, with the sampler of picture/nearest_sample.glsl.
    """
    samplers = [
        *((name, "FLOAT_2D") for name in ("strands_before", "strands_after", "moved_rows", "moved_points")),
        *((("object_motions", "FLOAT_2D"),) if is_batch else ()),
        *((("places", "UINT_2D"),) if is_nearest else ()),
    ]
    texture_format = CARRIED_MOTION_FORMAT if is_nearest else MOTION_FORMAT
    info = scene_programs.strand_samples_info(uniforms.MOTION.source, samplers, texture_format, is_batch=is_batch)
    info.uniform_buf(2, "Motion", "motion")
    info.define("HAS_AFTER", str(not is_nearest).lower())
    replaced = {}
    if is_batch:
        replaced["picture/object_motion.glsl"] = "picture/batch_motion.glsl"
    if is_nearest:
        replaced["visibility/own_sample.glsl"] = "picture/nearest_sample.glsl"
    return scene_programs.compile_samples(info, "picture/strand_motion.comp", replaced, is_batch)


@shaders.cached
def surface_motion_program(has_after):
    """Return the program of motion vectors of surfaces: see picture/surface_motion.vert.

    has_after: also from the next frame; else surfaces are drawn over their own depth.
    """
    info = gpu.types.GPUShaderCreateInfo()
    names = ("now", "before", "after") if has_after else ("now", "before")
    if has_after:
        info.define("HAS_PLACE_AFTER")
    info.typedef_source(uniforms.VIEW.source + uniforms.MOTION.source)
    info.uniform_buf(0, "View", "view")
    info.uniform_buf(1, "Motion", "motion")
    varying = gpu.types.GPUStageInterfaceInfo("motion_varying" if has_after else "motion_before_varying")
    for slot, name in enumerate(names):
        info.sampler(slot, "FLOAT_2D", "places" if name == "now" else f"places_{name}")
        varying.smooth("VEC4", f"place_{name}")
    info.vertex_out(varying)
    return shaders.compile_drawing(info, "picture/surface_motion.vert", "picture/surface_motion.frag")


DATA_FORMAT = "RGBA32F"  # of passes of data


@shaders.cached
def strand_data_program():
    """Return the compute program of passes of data of strands: see picture/strand_data.comp."""
    info = scene_programs.strand_samples_info(uniforms.DATA.source, (("root_uvs", "FLOAT_2D"),), DATA_FORMAT)
    info.uniform_buf(2, uniforms.DATA.type_name, "data")
    return shaders.compile_compute(info, "picture/strand_data.comp")


@shaders.cached
def film_view_program():
    """Return the program that shows the mean of a film: see picture/film_view.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("VEC4", "border")  # left, bottom, right and top of what is shown of the film [pixels]
    info.push_constant("VEC2", "origin")  # [pixels] of the film in the framebuffer
    info.push_constant("FLOAT", "weight_sum")
    info.sampler(0, "FLOAT_2D", "sums")
    return shaders.compile_drawing(info, "picture/cover.vert", "picture/film_view.frag")


BLOCK_SIDE = 8  # pixels: BLOCK_SIDE of shaders/picture/history_blocks.glsl


@shaders.cached
def blocks_program():
    """Return the compute program of the mean and deviation of blocks of pixels: see picture/history_blocks.comp."""
    return _filter("picture/history_blocks.comp", ("picture",), BLOCK_IMAGES, ("weight",))


@shaders.cached
def carry_program():
    """Return the compute program that reprojects the previous picture: see picture/history_carry.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.HISTORY.source)
    info.uniform_buf(0, "History", "history")
    of_blocks = ("before_mean", "before_deviation", "now_mean", "now_deviation")
    for slot, name in enumerate(("depths", "segments", "places")):
        info.sampler(slot, "UINT_2D", name)
    moved, of_light = ("hair_motion", "surface_motion"), ("light_before", "light_now")
    for slot, name in enumerate(("before", "before_passes", *of_blocks, *moved, *of_light), start=3):
        info.sampler(slot, "FLOAT_2D", name)
    return _written(info, "picture/history_carry.comp", CARRIED_IMAGES)


@shaders.cached
def places_program():
    """Return the compute program of the sample that represents each pixel: see picture/history_places.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.HISTORY.source)
    info.uniform_buf(0, "History", "history")
    info.sampler(0, "UINT_2D", "depths")
    info.sampler(1, "FLOAT_2D", "now_deviation")
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    info.image(0, "R32UI", "UINT_2D", "places", qualifiers={"WRITE"})
    return shaders.compile_compute(info, "picture/history_places.comp")


@shaders.cached
def mix_program():
    """Return the compute program that blends reprojected pixels with the passes: see picture/history_mix.comp."""
    samplers = ("sums", "carried", "carried_passes")
    return _filter("picture/history_mix.comp", samplers, CARRIED_IMAGES, ("weight", "pass_count", "part_left"))


# Images (name, format) that the programs of a history write.
CARRIED_IMAGES = (("colors", "RGBA16F"), ("weights", "R16F"))
BLOCK_IMAGES = (("means", "RGBA16F"), ("deviations", "RGBA16F"))


def _filter(file, samplers, images, constants):
    info = gpu.types.GPUShaderCreateInfo()
    for name in constants:
        info.push_constant("FLOAT", name)
    for slot, name in enumerate(samplers):
        info.sampler(slot, "FLOAT_2D", name)
    return _written(info, file, images)


def _written(info, file, images):
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    for slot, (name, texture_format) in enumerate(images):
        info.image(slot, texture_format, "FLOAT_2D", name, qualifiers={"WRITE"})
    return shaders.compile_compute(info, file)
