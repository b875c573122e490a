# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that filter lights' shadow maps: each fills `filtered`, or layers of it.

They are compute programs, as GPUs made for computing have few units for drawing.
"""

import gpu

from . import scene_programs, shaders, uniforms

_READ_WRITE = {"READ", "WRITE"}


@shaders.cached
def rows_program():
    """Return the program that finds the ends of each texel's row in `fronts` and `backs`, a deep opacity map's first
    pass.
    """
    return _filter("shadows/shadow_rows.comp", "RG32F", {"fronts": "UINT_2D", "backs": "UINT_2D"})


@shaders.cached
def fill_program():
    """Return the program that fills gaps of `fronts` and `backs` from the result of `rows_program`, into layers."""
    samplers = {"fronts": "UINT_2D", "backs": "UINT_2D", "row_ends": "FLOAT_2D"}
    return _filter("shadows/shadow_fill.comp", "RG32F", samplers, of_maps=True)


@shaders.cached
def counts_program():
    """Return the program that converts `counts`, a deep opacity map's second pass, into layers, and clears all its
    images.
    """
    images = {"counts": _READ_WRITE, "fronts": _READ_WRITE, "backs": _READ_WRITE}
    return _filter("shadows/shadow_counts.comp", "RGBA16F", {}, of_maps=True, images=images)


@shaders.cached
def hidden_program():
    """Return the program that finds the depth behind which the surfaces of `surface_depth` hide strands, into a
    layer.
    """
    return _filter("shadows/shadow_hidden.comp", "R32F", {"surface_depth": "FLOAT_2D_ARRAY"}, in_layer=True)


@shaders.cached
def moments_program():
    """Return the program that blurs `surface_depth` along an axis; is_depth: raw depths, else the result of the
    first axis.
    """
    constants = (("IVEC2", "along"), ("INT", "taps"), ("INT", "is_depth"), ("FLOAT", "deviation"))
    return _filter(
        "shadows/shadow_moments.comp", "RGBA32F", {"surface_depth": "FLOAT_2D_ARRAY"}, constants, in_layer=True
    )


def _filter(file, texture_format, samplers, constants=(), in_layer=False, of_maps=False, images=None):
    """Return the program of a file; texture_format: of `filtered`; in_layer: whether a layer of that is filled;
    of_maps: whether the layers of `uniforms.SHADOW_VIEWS` are filled; images: of integers.
    """
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    structs = uniforms.LIGHT.source
    info.typedef_source(structs + uniforms.VIEW.source + uniforms.SHADOW_VIEWS.source if of_maps else structs)
    for constant in (*constants, *((("INT", "layer"),) if in_layer else ())):
        info.push_constant(*constant)
    for slot, (sampler, kind) in enumerate(samplers.items()):
        info.sampler(slot, kind, sampler)
    if of_maps:
        info.uniform_buf(0, "ShadowViews", "shadow_views")
    kind = "FLOAT_2D_ARRAY" if in_layer or of_maps else "FLOAT_2D"
    info.image(0, texture_format, kind, "filtered", qualifiers={"WRITE"})
    for slot, (name, qualifiers) in enumerate((images or {}).items(), start=1):
        info.image(slot, "R32UI", "UINT_2D", name, qualifiers=qualifiers)
    return shaders.compile_compute(info, file)
