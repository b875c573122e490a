# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of GLSL functions from Python: every row of the inputs is one texel of a small picture."""

import gpu
import numpy as np

from hair_addon.blender.gpu.programs import shaders, uniforms

_WIDTH = 64  # of the picture; rows as needed

_COMPONENTS = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}

# The parts of a shading model that are no function of their arguments.
_MAIN = (
    "fibre/shade_strand.glsl",
    "light/irradiance.glsl",
    "light/strand_irradiance.glsl",
    "light/strand_visibility.glsl",
    "light/light_grid.glsl",
    "shadows/shadow.glsl",
    "strands/placement.glsl",
    "visibility/strand_samples.glsl",
    "light/world.glsl",
    "fibre/ambient_response.glsl",
    "visibility/strand_hit.glsl",
    "visibility/segment.glsl",
)


def source(*names):
    """Return the text of shader files with their includes, each file once, without the main that draws hair."""
    text, seen = [], set()
    for name in names:
        expanded, origins = shaders.expand(name)
        files = {file for file, _number in origins}
        pairs = zip(expanded.splitlines(), origins, strict=True)
        text += [line for line, (file, _number) in pairs if file not in seen and file not in _MAIN]
        seen |= files
    return "\n".join(text) + "\n"


def evaluate(text, returns, expression, *, textures=None, volumes=(), structs="", blocks=None, **inputs):
    """Return values of a GLSL expression, (N,) or (N, components) float32.

    text: GLSL before the expression, such as `source("fibre/fibre.glsl")`; returns: the expression's type; inputs: (N,)
    or (N, 2..4) arrays with their names in the expression, integers as int and others as float or vec; textures:
    {sampler: GPUTexture}; volumes: samplers that are three-dimensional; structs: declarations of the types of blocks;
    blocks: uniform blocks, {instance: (type, record)}.
    """
    textures, blocks = textures or {}, blocks or {}
    inputs = {name: np.asarray(values) for name, values in inputs.items()}
    count = len(next(iter(inputs.values())))
    size = (_WIDTH, -(-count // _WIDTH))
    program = _program(text, returns, expression, inputs, textures, volumes, structs, blocks)
    samplers = {f"{name}_input": _texture(values, size) for name, values in inputs.items()} | textures
    buffers = {name: uniforms.uniform_buffer(record) for name, (_type, record) in blocks.items()}
    target = gpu.types.GPUTexture(size, format="RGBA32F")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=target)
    triangle = gpu.types.GPUBatch(type="TRIS", buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), 3))
    with framebuffer.bind():
        program.bind()
        for name, texture in samplers.items():
            program.uniform_sampler(name, texture)
        for name, buffer in buffers.items():
            program.uniform_block(name, buffer)
        triangle.draw(program)
        # If a program is freed while bound, Blender takes the next one at the same address for bound.
        gpu.shader.unbind()
        pixels = np.array(framebuffer.read_color(0, 0, *size, 4, 0, "FLOAT"), np.float32)
    values = pixels.reshape(-1, 4)[:count, : _COMPONENTS[returns]]
    return values[:, 0] if returns == "float" else values


def _program(text, returns, expression, inputs, textures, volumes, structs, blocks):
    info = gpu.types.GPUShaderCreateInfo()
    info.typedef_source(structs)
    for slot, (name, (type_name, _record)) in enumerate(blocks.items()):
        info.uniform_buf(slot, type_name, name)
    for slot, name in enumerate([*(f"{name}_input" for name in inputs), *textures]):
        info.sampler(slot, "FLOAT_3D" if name in volumes else "FLOAT_2D", name)
    reads = "".join(_read(name, values) for name, values in inputs.items())
    zeros = ", 0.0" * (4 - _COMPONENTS[returns])
    info.vertex_source(shaders.expand("picture/cover.vert")[0])
    info.fragment_source(f"{text}\nvoid main()\n{{\n{reads}  color = vec4({expression}{zeros});\n}}\n")
    info.fragment_out(0, "VEC4", "color")
    return gpu.shader.create_from_info(info)


def _read(name, values):
    components = 1 if values.ndim == 1 else values.shape[1]
    kind = "float" if components == 1 else f"vec{components}"
    value = f"texelFetch({name}_input, ivec2(gl_FragCoord.xy), 0).{'xyzw'[:components]}"
    if values.dtype.kind == "i":
        return f"  int {name} = int({value});\n"
    return f"  {kind} {name} = {value};\n"


def _texture(values, size):
    columns = values.reshape(len(values), -1)
    texels = np.zeros((size[0] * size[1], 4), np.float32)
    texels[: len(values), : columns.shape[1]] = columns
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture(size, format="RGBA32F", data=data)
