# SPDX-License-Identifier: GPL-3.0-or-later
"""GPU programs that draw a scene's hair, surroundings and pictures, and their inputs."""

import gpu

from . import uniforms
from .shaders import COLOR, cached, compile_compute, compile_drawing

# Textures of lamps: their shadow maps and patterns.
SHADOW_SAMPLERS = ("hair_front", "hair_layers", "surface_moments", "light_patterns")
# See shaders/light/world_visibility.comp.
VISIBILITY_SAMPLERS = (
    "visibility_x_y",
    "visibility_z",
    "visibility_surface",
    "visibility_channels",
    "visibility_color",
)
STRAND_SAMPLERS = ("strands", "strand_radii")  # see shaders/visibility/segment.glsl


# Linked hair objects are drawn together: see shaders/strands/batch_object.glsl.
_BATCH_FIRST = "strands/batch_object.glsl"
_BATCH_REPLACED = {
    "strands/placement.glsl": "strands/batch_placement.glsl",
    "strands/run_group.glsl": "strands/batch_run_group.glsl",
    "light/strand_visibility.glsl": "light/layer_visibility.glsl",
    "fibre/solid_tint.glsl": "strands/batch_tint.glsl",
}
_MAPS_REPLACED = {"strands/shared_view.glsl": "shadows/view_of_map.glsl"}
_BATCH_SAMPLER = ("objects", "FLOAT_2D")


def declare_scene(info, structs="", shadow_samplers=SHADOW_SAMPLERS, is_lit=True, is_batch=False, is_of_maps=False):
    """Declare the inputs of all scene shaders: camera, lights, shadow maps, world lighting; is_batch: for linked hair
    objects; is_of_maps: of several shadow maps.
    """
    structs = uniforms.VIEW.source + uniforms.LIGHT.source + uniforms.LIGHTS.source + structs
    info.typedef_source(structs + uniforms.SHADOW_VIEWS.source if is_of_maps else structs)
    if is_of_maps:
        info.uniform_buf(0, "ShadowViews", "shadow_views")
    else:
        info.uniform_buf(0, "View", "shared_view" if is_batch else "view")
    info.uniform_buf(1, "Lights", "lights")
    for slot, name in enumerate(shadow_samplers):
        info.sampler(slot, "FLOAT_2D_ARRAY", name)
    if is_lit:
        for slot, name in enumerate(VISIBILITY_SAMPLERS, start=len(SHADOW_SAMPLERS)):
            info.sampler(slot, "FLOAT_2D_ARRAY" if is_batch else "FLOAT_2D", name)


def declare_clipped_scene(info, shadow_samplers, is_clipped, is_batch=False, is_of_maps=False):
    """`declare_scene` without the world's lighting; returns the includes that are replaced."""
    structs = uniforms.CLIPPING.source if is_clipped else ""
    declare_scene(info, structs, shadow_samplers, is_lit=False, is_batch=is_batch, is_of_maps=is_of_maps)
    if not is_clipped:
        return _MAPS_REPLACED if is_of_maps else {}
    info.uniform_buf(2, "Clipping", "clipping")
    return {"visibility/unclipped.glsl": "visibility/clipped.glsl"}


def has_image_atomics():
    """Whether image atomics are available: on Metal, Python cannot declare them."""
    return gpu.platform.backend_type_get() in {"OPENGL", "VULKAN"}


@cached
def strip_program(fragment, shadow_samplers=(), targets=COLOR):
    """Return the program that draws strips of strands with a .frag; targets: its (output, type), ...

    shadow_samplers: of shadow maps.
    """
    info = gpu.types.GPUShaderCreateInfo()
    replaced = _strip(info, shadow_samplers, is_clipped=False)
    return compile_drawing(info, "strands/strip.vert", fragment, targets, replaced)


@cached
def guide_program(is_clipped=False):
    """Return the program that draws guides as lines: see strands/guides.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    replaced = _strip(info, (), is_clipped)
    info.push_constant("VEC4", "line_color")
    info.push_constant("FLOAT", "strip_width")
    info.push_constant("INT", "color_source")
    info.push_constant("INT", "frozen_places")
    for slot, name in enumerate(("frozen", "hues"), start=len(SHADOW_SAMPLERS) + len(STRAND_SAMPLERS)):
        info.sampler(slot, "FLOAT_2D", name)
    return compile_drawing(info, "strands/strip.vert", "strands/guides.frag", COLOR, replaced)


@cached
def strip_segments_program(is_clipped):
    """Return the program that draws strips of strands as samples of a picture: see visibility/strand_segments.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    replaced = _strip(info, (), is_clipped)
    info.depth_write("ANY")
    targets = (("segment", "UINT"), ("depth", "UINT"))
    return compile_drawing(info, "strands/strip.vert", "visibility/strand_segments.frag", targets, replaced)


def _strip(info, shadow_samplers, is_clipped):
    replaced = declare_clipped_scene(info, shadow_samplers, is_clipped)
    for slot, name in enumerate(STRAND_SAMPLERS, start=len(SHADOW_SAMPLERS)):
        info.sampler(slot, "FLOAT_2D", name)
    varying = gpu.types.GPUStageInterfaceInfo("strand_varying")
    varying.smooth("VEC3", "drawn_position")
    varying.smooth("FLOAT", "strand_coverage")
    varying.smooth("FLOAT", "strand_offset_part")
    varying.smooth("FLOAT", "strand_rise")  # of depth, from the axis to the side that faces the viewer
    varying.smooth("FLOAT", "strand_side_place")  # across the strip, from -1 to 1
    varying.smooth("FLOAT", "strand_place")  # along the strand, in drawn points
    varying.flat("INT", "strand_index")
    info.vertex_out(varying)
    return replaced


RUN_GROUP_SIZE = 64  # runs of segments per work group of a program that rasterizes strands
RUN_LENGTH = 8  # segments of a run: RUN_LENGTH of shaders/visibility/rasterize_segment.glsl


@cached
def segments_program(is_depth, is_round, is_clipped=False, is_batch=False):
    """Return the compute program that draws strands as samples of a picture: see visibility/strand_segments.comp.

    is_batch: of linked hair objects.
    """
    images, constants = ("depths", "segments", "seen_runs"), ("are_tiles_known",)
    defined, samplers = {"IS_DEPTH": is_depth, "IS_ROUND": is_round}, (("farthest_depths", "UINT_2D"),)
    options = {"samplers": samplers, "is_clipped": is_clipped, "is_batch": is_batch}
    if not is_batch:
        constants = ("first_run", *constants)
    return _walk("visibility/strand_segments.comp", images, defined, constants, **options)


@cached
def parts_program(is_round, is_clipped=False, is_batch=False):
    """Return the compute program that finds the parts of samples that strands cover: see visibility/strand_parts.comp.

    is_batch: of linked hair objects.
    """
    options = {"samplers": (("surface_depth", "FLOAT_2D"),), "is_clipped": is_clipped, "is_batch": is_batch}
    counting = {"visibility/uncounted.glsl": "visibility/covered_parts.glsl"}
    defined, images = {"IS_ROUND": is_round}, ("depths", "covered")
    return _walk("visibility/strand_parts.comp", images, defined, **options, counting=counting)


@cached
def strand_shadow_program(is_front):
    """Return the compute program that draws strands into deep opacity maps: see shadows/strand_shadow.comp."""
    images, defined = ("fronts", "backs", "counts"), {"IS_FRONT": is_front, "IS_ROUND": False}
    options = {"shadow_samplers": ("hair_front", "hidden_depth"), "is_batch": True, "is_of_maps": True}
    return _walk("shadows/strand_shadow.comp", images, defined, **options)


def _walk(
    file,
    images,
    defined,
    constants=(),
    shadow_samplers=(),
    samplers=(),
    is_clipped=False,
    is_batch=False,
    is_of_maps=False,
    counting=None,
):
    info = gpu.types.GPUShaderCreateInfo()
    for name, value in defined.items():
        info.define(name, str(value).lower())
    replaced = declare_clipped_scene(info, shadow_samplers, is_clipped, is_batch, is_of_maps) | (counting or {})
    if is_batch:
        samplers, constants = (*samplers, _BATCH_SAMPLER), (*constants, "object_count")
    info.local_group_size(RUN_GROUP_SIZE)
    own = tuple((name, "FLOAT_2D") for name in STRAND_SAMPLERS)
    for slot, (name, kind) in enumerate((*own, *samplers), start=len(SHADOW_SAMPLERS)):
        info.sampler(slot, kind, name)
    for slot, name in enumerate(images):
        info.image(slot, "R32UI", "UINT_2D", name, qualifiers={"NO_RESTRICT", "READ", "WRITE"})
    for name in (*constants, "walked_part"):
        info.push_constant("INT", name)
    return compile_samples(info, file, replaced, is_batch)


def compile_samples(info, file, replaced, is_batch):
    """Return the compute program of a file about strands; is_batch: for linked hair objects."""
    if not is_batch:
        return compile_compute(info, file, replaced)
    return compile_compute(info, file, replaced | _BATCH_REPLACED, first=_BATCH_FIRST)


PICTURE_FORMAT = "RGBA16F"  # of the light that `shading_program` leaves
PICTURE_GROUP_SIZE = 8  # threads along each side of a work group of a picture's programs
SAMPLES_OF_THREAD = 8  # SAMPLES_OF_THREAD of shaders/visibility/strand_samples.glsl


@cached
def shading_program(
    file,
    blocks=(),
    tables=(),
    is_mapped=False,
    is_radial=False,
    in_parts=False,
    is_mixed=False,
    is_solid=False,
    is_batch=False,
):
    """Return the compute program that shades strands with a model's .comp.

    blocks: (instance, class of settings), ...; tables: (sampler, type), ...; is_mapped: each strand has a look of its
    own, in the sampler of fibre/mapped_strand.glsl; is_radial: also a radial roughness of its own, in the sampler of
    fibre/strand_radial.glsl; in_parts: draw a part of the light, selected by the constants of
    fibre/part_of_lobes.glsl; is_mixed: draw the share of one of two looks, by the constants
    of fibre/mixed_looks.glsl; is_solid: for Solid shading, by the block of fibre/solid_light.glsl; is_batch: of linked
    hair objects.
    """
    structs = [uniforms.settings_block(settings_class, instance) for instance, settings_class in blocks]
    structs_source = "".join(block.source for block in structs)
    samplers = (*tables, ("strand_wetness", "FLOAT_2D")) if is_mixed else tables
    if is_solid:
        samplers = (*samplers, ("strand_tints", "FLOAT_2D"), ("matcap", "FLOAT_2D"))
        structs_source += uniforms.SOLID.source
    info = strand_samples_info(structs_source, samplers, is_mixed=is_mixed, is_batch=is_batch)
    for slot, ((instance, _class), block) in enumerate(zip(blocks, structs, strict=True), start=2):
        info.uniform_buf(slot, block.type_name, instance)
    replaced = {}
    if is_mapped:
        replaced["fibre/varied_strand.glsl"] = "fibre/mapped_strand.glsl"
        replaced["fibre/dual_along.glsl"] = "fibre/dual_of_strand.glsl"
    if is_radial:
        replaced["fibre/one_layer.glsl"] = "fibre/radial_layers.glsl"
        replaced["fibre/look_falloff.glsl"] = "fibre/strand_falloff.glsl"
    if is_solid:
        replaced["fibre/shown_light.glsl"] = "fibre/solid_light.glsl"
        info.uniform_buf(2 + len(structs), uniforms.SOLID.type_name, "solid")
    if in_parts:
        replaced["fibre/drawn_lobes.glsl"] = "fibre/part_of_lobes.glsl"
        info.push_constant("VEC4", "part_lobes")
        info.push_constant("FLOAT", "part_world")
    if is_mixed:
        replaced["fibre/single_look.glsl"] = "fibre/mixed_looks.glsl"
        info.push_constant("VEC2", "wetness_range")
        info.push_constant("INT", "is_wet")
    return compile_samples(info, file, replaced, is_batch)


def strand_samples_info(structs="", samplers=(), texture_format=PICTURE_FORMAT, is_mixed=False, is_batch=False):
    """Return the info of a program that includes visibility/strand_samples.glsl.

    samplers: (name, type), ... besides the scene's; texture_format: of the image that it fills; is_mixed: whether it
    also reads the image; is_batch: of linked hair objects.
    """
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(PICTURE_GROUP_SIZE, PICTURE_GROUP_SIZE)
    declare_scene(info, structs, is_batch=is_batch)
    first = len(SHADOW_SAMPLERS) + len(VISIBILITY_SAMPLERS)
    samplers = (*samplers, _BATCH_SAMPLER) if is_batch else samplers
    own = tuple((name, "FLOAT_2D") for name in STRAND_SAMPLERS)
    read = (("segments", "UINT_2D"), *own, ("light_grid", "FLOAT_3D"), *samplers)
    for slot, (name, kind) in enumerate(read, start=first):
        info.sampler(slot, kind, name)
    info.image(0, texture_format, "FLOAT_2D", "picture", qualifiers={"READ", "WRITE"} if is_mixed else {"WRITE"})
    for name in ("window_left", "window_bottom", *(("object_count", "last_segment") if is_batch else ())):
        info.push_constant("INT", name)
    return info


@cached
def environment_program(fragment):
    """Return the program that draws a picture of the world with a .frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.ENVIRONMENT.source)
    info.uniform_buf(0, "Environment", "environment")
    info.sampler(0, "FLOAT_2D", "surroundings")
    return compile_drawing(info, "picture/cover.vert", fragment)


@cached
def resolve_program():
    """Return the program that averages blocks of samples_per_side² texels of `picture`."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("INT", "samples_per_side")
    info.sampler(0, "FLOAT_2D", "picture")
    return compile_drawing(info, "picture/cover.vert", "picture/resolve.frag")


@cached
def accumulate_program():
    """Return the compute program that adds a pass to the picture of a viewport: see picture/accumulate.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(PICTURE_GROUP_SIZE, PICTURE_GROUP_SIZE)
    info.push_constant("INT", "samples_per_side")
    info.push_constant("INT", "is_first")
    info.push_constant("IVEC2", "first_place")  # origin of the textures in the picture [samples]
    info.push_constant("FLOAT", "spread")
    info.sampler(0, "FLOAT_2D", "picture")
    info.sampler(1, "UINT_2D", "depths")
    info.sampler(2, "FLOAT_2D", "surface_depth")
    info.image(0, PICTURE_FORMAT, "FLOAT_2D", "sums", qualifiers={"READ", "WRITE"})
    info.image(1, "R32F", "FLOAT_2D", "nearest_depths", qualifiers={"READ", "WRITE"})
    return compile_compute(info, "picture/accumulate.comp")


@cached
def first_picture_program():
    """Return the compute program of the first picture from one sample per pixel: see picture/first_picture.comp."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(PICTURE_GROUP_SIZE, PICTURE_GROUP_SIZE)
    info.push_constant("IVEC2", "first_place")  # origin of the textures in the picture [pixels]
    info.push_constant("FLOAT", "color_radius")  # of the mean of colors [pixels]
    info.sampler(0, "FLOAT_2D", "picture")
    info.sampler(1, "UINT_2D", "covered")
    info.image(0, PICTURE_FORMAT, "FLOAT_2D", "first_picture", qualifiers={"WRITE"})
    return compile_compute(info, "picture/first_picture.comp")


@cached
def display_program():
    """Return the program that shows hair over a viewport: see picture/display.frag."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("VEC4", "border")  # left, bottom, right and top of what is shown of the picture [pixels]
    info.push_constant("VEC2", "origin")  # of the picture in the framebuffer [pixels]
    info.push_constant("FLOAT", "exposure")
    info.push_constant("FLOAT", "opacity")
    info.push_constant("INT", "pass_count")
    info.push_constant("FLOAT", "first_part")
    info.sampler(0, "FLOAT_2D", "passes")
    info.sampler(1, "FLOAT_2D", "depths")
    info.sampler(2, "FLOAT_3D", "display_table")
    info.sampler(3, "FLOAT_2D", "first_picture")
    info.depth_write("ANY")
    return compile_drawing(info, "picture/cover.vert", "picture/display.frag")
