# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs: #include expansion, programs compiled once and kept."""

import re
from functools import cache
from pathlib import Path

import gpu

from ..core.errors import HairError
from . import uniforms

FOLDER = Path(__file__).resolve().parents[2] / "shaders"

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')


def expand(name):
    """(text, lines): the file with every #include put in its place once, and each line's (file, number)."""
    text, lines, seen = [], [], set()

    def add(file):
        if file in seen:
            return
        seen.add(file)
        path = FOLDER / file
        if not path.is_file():
            raise HairError(f"The shader file {file} is missing: install Vellus again.")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            include = _INCLUDE.match(line)
            if include:
                add(include.group(1))
            else:
                text.append(line)
                lines.append((file, number))

    add(name)
    return "\n".join(text) + "\n", lines


SHADOW_SAMPLERS = ("hair_front", "hair_layers", "surface_front")
VOLUME_SAMPLERS = ("volume_x_y", "volume_z")  # see shaders/include/world.glsl


def _scene(info, structs="", shadow_samplers=SHADOW_SAMPLERS):
    """What every shader of the scene sees: camera and lights, and the shadow maps that have been drawn so far."""
    info.typedef_source(uniforms.VIEW.source + uniforms.LIGHT.source + uniforms.LIGHTS.source + structs)
    info.uniform_buf(0, "View", "view")
    info.uniform_buf(1, "Lights", "lights")
    for slot, name in enumerate(shadow_samplers):
        info.sampler(slot, "FLOAT_2D_ARRAY", name)
    if shadow_samplers == SHADOW_SAMPLERS:
        for slot, name in enumerate(VOLUME_SAMPLERS, start=len(SHADOW_SAMPLERS)):
            info.sampler(slot, "FLOAT_3D", name)


@cache
def strand_program(fragment, settings_class=None, table_names=(), shadow_samplers=SHADOW_SAMPLERS):
    """The program that draws strands: a .frag, the class of its settings, its table samplers, its shadow maps."""
    info = gpu.types.GPUShaderCreateInfo()
    _scene(info, uniforms.settings_block(settings_class).source if settings_class else "", shadow_samplers)
    if settings_class:
        info.uniform_buf(2, "Settings", "settings")
    first = len(SHADOW_SAMPLERS) + len(VOLUME_SAMPLERS)
    for slot, name in enumerate(("strands", *table_names), start=first):
        info.sampler(slot, "FLOAT_2D", name)
    varying = gpu.types.GPUStageInterfaceInfo("strand_varying")
    varying.smooth("VEC3", "drawn_position")
    varying.smooth("VEC3", "strand_tangent")
    varying.smooth("FLOAT", "strand_coverage")
    varying.flat("INT", "strand_index")
    info.vertex_out(varying)
    return _compile(info, "strand.vert", fragment)


@cache
def surface_program(fragment, shadow_samplers=SHADOW_SAMPLERS):
    """The program that draws a matt surface: attributes position, normal; uniform surface_color."""
    info = gpu.types.GPUShaderCreateInfo()
    _scene(info, shadow_samplers=shadow_samplers)
    info.push_constant("VEC3", "surface_color")
    info.vertex_in(0, "VEC3", "position")
    info.vertex_in(1, "VEC3", "normal")
    varying = gpu.types.GPUStageInterfaceInfo("surface_varying")
    varying.smooth("VEC3", "drawn_position")
    varying.smooth("VEC3", "surface_normal")
    info.vertex_out(varying)
    return _compile(info, "surface.vert", fragment)


@cache
def resolve_program():
    """The program that averages blocks of samples_per_side² texels of `picture`."""
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("INT", "samples_per_side")
    info.sampler(0, "FLOAT_2D", "picture")
    return _compile(info, "cover.vert", "resolve.frag")


def _compile(info, vertex, fragment):
    vertex_text, _lines = expand(vertex)
    fragment_text, _lines = expand(fragment)
    info.vertex_source(vertex_text)
    info.fragment_source(fragment_text)
    info.fragment_out(0, "VEC4", "color")
    try:
        return gpu.shader.create_from_info(info)
    except Exception as error:
        raise HairError(f"The shader {fragment} does not compile on this graphics driver: {error}") from error
