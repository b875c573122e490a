# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that sum the visibility of the world into images with a texel for each place.

They are compute programs, as GPUs made for computing have few units for drawing.
"""

import gpu

from . import scene_programs, shaders

IMAGES = (
    "seen_x_y",
    "seen_z",
    "seen_surface",
    "seen_channels",
    "seen_color",
)  # in the order of VISIBILITY_SAMPLERS
BYTES = "RGBA8"  # format of textures of strands' visibility
SUMS = "RGBA16F"  # format of textures of sums
# Threads of a work group: a row of texels, as textures of few strands have few rows.
GROUP_SIZE = (64, 1)

_PUT = {"light/write_visibility_sums.glsl": "light/write_visibility_bytes.glsl"}


@shaders.cached
def visibility_program(texture_format):
    """Return the program that sums the visibility of the world from the texels of `places`.

    texture_format: `SUMS`, to which directions are added one by one; `BYTES`: all are added at once.
    """
    info = _program(texture_format)
    scene_programs.declare_scene(info, is_lit=False)
    for slot, name in enumerate(("places", "strand_radii"), start=len(scene_programs.SHADOW_SAMPLERS)):
        info.sampler(slot, "FLOAT_2D", name)
    if texture_format != SUMS:
        return shaders.compile_compute(info, "light/world_visibility.comp", _PUT)
    info.push_constant("INT", "is_first")
    return shaders.compile_compute(info, "light/world_visibility.comp")


@shaders.cached
def bytes_program():
    """Return the program that converts strands' visibility from `SUMS` to `BYTES`."""
    info = _program(BYTES)
    for slot, name in enumerate(scene_programs.VISIBILITY_SAMPLERS):
        info.sampler(slot, "FLOAT_2D", name)
    return shaders.compile_compute(info, "light/visibility_bytes.comp")


def _program(texture_format):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(*GROUP_SIZE)
    qualifiers = {"READ", "WRITE"} if texture_format == SUMS else {"WRITE"}
    for slot, name in enumerate(IMAGES):
        info.image(slot, texture_format, "FLOAT_2D", name, qualifiers=qualifiers)
    return info
