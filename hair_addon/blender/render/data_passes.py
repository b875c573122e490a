# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of data of the nearest surface or strand in each sample: position, mist, normal, and colors without light."""

import numpy as np

from ..gpu import drawing, surface_shading, surface_textures
from ..gpu.programs import picture_programs, uniforms
from . import scene_drawing

# Passes by their index in shaders/picture/data_value.glsl.
KINDS = ("Position", "Mist", "Normal", "Diffuse Color", "Denoising Normal", "Denoising Albedo", "UV")

# Settings of a view layer → pass.
SETTINGS = {
    "use_pass_mist": "Mist",
    "use_pass_position": "Position",
    "use_pass_normal": "Normal",
    "use_pass_uv": "UV",
    "use_pass_diffuse_color": "Diffuse Color",
}
DENOISING = ("Noisy Image", "Denoising Albedo", "Denoising Normal")


def draw(drawn, name, world_to_view, view, buffer):
    """Return a texture of a pass out of `KINDS` for the `VisibilityBuffer` that a `DrawnScene` was drawn into.

    world_to_view: (4, 4) of the camera, without its lens. Mist is the fraction of light that it lets through; alpha is
    one in samples with hair or a surface other than holdouts.
    """
    record = _record(drawn.mist, name, world_to_view)
    surfaces = zip(drawn.surfaces, *scene_drawing.light_of(drawn, solid=True), strict=True)
    with buffer.surfaces_of_part(picture_programs.DATA_FORMAT), drawing.gpu_state("LESS_EQUAL", depth_writes=True):
        for (surface, parts), lights, samplers in surfaces:
            if parts is None:
                light_block = uniforms.uniform_buffer(lights)
                surface_textures.draw_depth(surface, view, light_block, "surfaces/occluding_surface.frag")
            else:
                record["has_uvs"] = surface.corners.uvs is not None
                surface_shading.draw_data(surface, parts, view, lights, samplers, record)
    textures = drawn.root_uvs or [None] * len(drawn.hair)
    inputs = [_of_hair(record, texture) for texture in textures]
    return buffer.part_by(picture_programs.strand_data_program(), picture_programs.DATA_FORMAT, inputs)


def _of_hair(record, root_uvs):
    """Return ({instance: record}, {sampler: texture}) of a hair; root_uvs: its texture, or None."""
    own = record.copy()
    own["has_uvs"] = root_uvs is not None
    return {"data": own}, {"root_uvs": root_uvs or surface_shading.white()}


def _record(mist, name, world_to_view):
    record = uniforms.DATA.record()
    record["camera"][:3] = np.linalg.inv(world_to_view)[:3, 3]
    record["view_rows"][:, :3] = world_to_view[:3, :3]
    record["mist"][:3] = mist.start, 1.0 / mist.depth if mist.depth > 0.0 else 0.0, mist.exponent
    record["kind"] = KINDS.index(name)
    return record
