# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that add up how much of the world is seen: images of what is seen, a texel for each place.

They are compute programs: graphics cards made for computing draw with few of their processors.
"""

import gpu

from . import scene_programs, shaders

IMAGES = (
    "seen_x_y",
    "seen_z",
    "seen_surface",
    "seen_channels",
    "seen_color",
)  # as VISIBILITY_SAMPLERS
BYTES = "RGBA8"  # of textures that strands' visibility is kept in
SUMS = "RGBA16F"  # and of those in which sums are added up

_PUT = {"light/write_visibility_sums.glsl": "light/write_visibility_bytes.glsl"}


@shaders.kept
def visibility_program(texture_format):
    """The program that adds up how much of the world the texels of `places` see.

    texture_format: `SUMS`, to which directions are added; else all are added at once, and kept as `BYTES`.
    """
    info = _program(texture_format)
    scene_programs.declare_scene(info, is_lit=False)
    for slot, name in enumerate(("places", "strand_radii"), start=len(scene_programs.SHADOW_SAMPLERS)):
        info.sampler(slot, "FLOAT_2D", name)
    if texture_format != SUMS:
        return shaders.compile_compute(info, "light/world_visibility.comp", _PUT)
    info.push_constant("INT", "is_first")
    return shaders.compile_compute(info, "light/world_visibility.comp")


@shaders.kept
def bytes_program():
    """The program that keeps what strands see in fewer bytes."""
    info = _program(BYTES)
    for slot, name in enumerate(scene_programs.VISIBILITY_SAMPLERS):
        info.sampler(slot, "FLOAT_2D", name)
    return shaders.compile_compute(info, "light/visibility_bytes.comp")


def _program(texture_format):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(scene_programs.PICTURE_GROUP_SIZE, scene_programs.PICTURE_GROUP_SIZE)
    qualifiers = {"READ", "WRITE"} if texture_format == SUMS else {"WRITE"}
    for slot, name in enumerate(IMAGES):
        info.image(slot, texture_format, "FLOAT_2D", name, qualifiers=qualifiers)
    return info
