# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs that sum the visibility of the world into images with a texel for each place.

They are compute programs, as GPUs made for computing have few units for drawing.
"""

import gpu

from . import scene_programs, shaders, surface_programs

IMAGES = (
    "seen_x_y",
    "seen_z",
    "seen_surface",
    "seen_channels",
    "seen_color",
)  # in the order of VISIBILITY_SAMPLERS
JOINED = ("joined_x_y", "joined_z")  # images of `join_program`
BYTES = "RGBA8"  # format of textures of strands' visibility
SUMS = "RGBA16F"  # format of textures of sums
# Threads of a work group: a row of texels, as textures of few strands have few rows.
GROUP_SIZE = (64, 1)

_SUMS_FILE, _BYTES_FILE = "light/write_visibility_sums.glsl", "light/write_visibility_bytes.glsl"
_LAYER_FILE = "light/write_visibility_layer.glsl"


@shaders.cached
def visibility_program(texture_format, in_layer=False):
    """Return the program that sums the visibility of the world from the texels of `places`.

    texture_format: `SUMS` if directions are added one by one, `BYTES` if all are added at once; in_layer: whether
    bytes are written to a layer of array textures.
    """
    info = _program(texture_format, in_layer)
    scene_programs.declare_scene(info, is_lit=False)
    for slot, name in enumerate(("places", "strand_radii"), start=len(scene_programs.SHADOW_SAMPLERS)):
        info.sampler(slot, "FLOAT_2D", name)
    if texture_format != SUMS:
        replaced = {_SUMS_FILE: _LAYER_FILE if in_layer else _BYTES_FILE}
        return shaders.compile_compute(info, "light/world_visibility.comp", replaced)
    info.push_constant("INT", "is_first")
    return shaders.compile_compute(info, "light/world_visibility.comp")


@shaders.cached
def bytes_program(in_layer=False):
    """Return the program that converts strands' visibility from `SUMS` to `BYTES`; in_layer: to array textures."""
    info = _program(BYTES, in_layer)
    for slot, name in enumerate(scene_programs.VISIBILITY_SAMPLERS):
        info.sampler(slot, "FLOAT_2D", name)
    replaced = {_BYTES_FILE: _LAYER_FILE} if in_layer else {}
    return shaders.compile_compute(info, "light/visibility_bytes.comp", replaced)


@shaders.cached
def join_program():
    """Return the program that copies a surface's visibility into a layer of array textures, for linked surfaces."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(*GROUP_SIZE)
    for slot, name in enumerate(JOINED):
        info.image(slot, SUMS, "FLOAT_2D_ARRAY", name, qualifiers={"WRITE"})
    for slot, name in enumerate(surface_programs.SEEN_SAMPLERS):
        info.sampler(slot, "FLOAT_2D", name)
    info.push_constant("INT", "layer")
    return shaders.compile_compute(info, "light/join_visibility.comp")


def _program(texture_format, in_layer):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(*GROUP_SIZE)
    qualifiers = {"READ", "WRITE"} if texture_format == SUMS else {"WRITE"}
    for slot, name in enumerate(IMAGES):
        info.image(slot, texture_format, "FLOAT_2D_ARRAY" if in_layer else "FLOAT_2D", name, qualifiers=qualifiers)
    if in_layer:
        info.push_constant("INT", "layer")
    return info
