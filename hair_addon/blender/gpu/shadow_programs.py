# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that filter a light's shadow map."""

import gpu

from . import shaders, uniforms


@shaders.kept
def rows_program():
    """The program that finds the ends of each texel's row in `fronts` and `backs`, a deep opacity map's first pass."""
    return _filter("shadow_rows.frag", {"fronts": "UINT_2D", "backs": "UINT_2D"})


@shaders.kept
def fill_program():
    """The program that fills gaps of `fronts` and `backs` from the result of `rows_program`."""
    return _filter("shadow_fill.frag", {"fronts": "UINT_2D", "backs": "UINT_2D", "row_ends": "FLOAT_2D"})


@shaders.kept
def counts_program():
    """The program that makes layers of `counts`, a deep opacity map's second pass where it is computed."""
    return _filter("shadow_counts.frag", {"counts": "UINT_2D"})


@shaders.kept
def hidden_program():
    """The program that finds the depth behind which strands are hidden by the surfaces of `surface_depth`."""
    return _filter("shadow_hidden.frag", {"surface_depth": "FLOAT_2D"})


@shaders.kept
def moments_program():
    """The program that blurs `surface_depth` along an axis: depths if is_depth, else its first result."""
    constants = (("IVEC2", "along"), ("INT", "taps"), ("INT", "is_depth"), ("FLOAT", "deviation"))
    return _filter("shadow_moments.frag", {"surface_depth": "FLOAT_2D"}, constants)


def _filter(fragment, samplers, constants=()):
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(uniforms.LIGHT.source)
    for constant in constants:
        info.push_constant(*constant)
    for slot, (sampler, kind) in enumerate(samplers.items()):
        info.sampler(slot, kind, sampler)
    return shaders.compile_drawing(info, "cover.vert", fragment)
