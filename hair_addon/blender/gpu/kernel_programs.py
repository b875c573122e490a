# SPDX-License-Identifier: GPL-3.0-or-later
"""Warp kernels on any graphics card: compute programs from the source that Warp compiles for CPU and CUDA.

The arrays of a kernel are concatenated in three textures: floats, vectors, and integers as their high and low 16 bits.
A kernel therefore needs only three samplers.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import gpu
import numpy as np
import warp as wp

from ...core.geometry.search import triangle_tree
from ...core.kernels import glsl_text
from . import driver_textures
from .programs import shaders, uniforms
from .strand_textures import TEXTURE_WIDTH, run_for_each

_GROUP_SIZE = 64

# Type of an element → the texture that contains it.
_TEXTURE_OF = {"float": "floats", **dict.fromkeys(("vec2", "vec3", "vec4"), "vectors"), "int": "words", "uint": "words"}
_FORMATS = {"floats": ("R32F", 1), "vectors": ("RGBA32F", 4), "words": ("RG32F", 2)}


@dataclass(frozen=True)
class _Program:
    """A compiled kernel."""

    shader: gpu.types.GPUShader
    block: uniforms.Block
    text: glsl_text.KernelText


@dataclass(frozen=True, eq=False)
class KernelOnGPU:
    """A kernel whose parameters are on the GPU; made by `prepare`."""

    program: _Program
    textures: dict[str, gpu.types.GPUTexture]
    record: np.ndarray  # of the program's block

    @cached_property
    def _buffer(self):
        return uniforms.own_uniform_buffer(self.record)  # `run` updates it

    def run(self, count: int, first: int = 0) -> dict[str, np.ndarray]:
        """Run `count` threads and return the arrays that they write: {name: (count,) or (count, 3)}, zero where nothing
        is written.

        first: the kernel's parameter of this name, the index of the first thread's element.
        """
        if first and "first" not in self.program.text.members:
            raise ValueError(f"the kernel has no parameter `first`, so it cannot begin at element {first}")
        self.record["first"] = first
        self.record["thread_count"] = count
        self._buffer.update(uniforms.bytes_of(self.record))
        shader, written = self.program.shader, self.program.text.written
        images = {name: _empty(count, kind) for name, kind in written.items()}
        shader.bind()
        shader.uniform_block("given", self._buffer)
        for name, texture in self.textures.items():
            shader.uniform_sampler(name, texture)
        for name, image in images.items():
            shader.image(name, image)
        run_for_each(shader, count, _GROUP_SIZE)
        gpu.shader.unbind()
        return {name: _read(image, count, written[name]) for name, image in images.items()}


def prepare(kernel: wp.Kernel, given: Mapping[str, Any], triangles: np.ndarray | None = None) -> KernelOnGPU:
    """Upload a kernel's parameters; given: {parameter: value} as for `wp.launch`, without `first` and the arrays that
    it writes.

    triangles: (F, 3, 3) corners of the mesh that it traces rays through. Raises `HairError` if the driver cannot
    compile the kernel, or memory is insufficient.
    """
    program = _program(kernel)
    record = program.block.record()
    for name, one in program.text.members.items():
        if name == "first":  # of `run`
            continue
        record[name] = _numbers(_value_of(given, one))
    parts: dict[str, list[np.ndarray]] = {texture: [] for texture in _FORMATS}
    for name, one in program.text.arrays.items():
        array = _value_of(given, one)
        for axis, side in enumerate(array.shape):
            record[f"{name}_side_{axis}"] = side
        record[f"{name}_first"] = _append(parts, _TEXTURE_OF[glsl_text.kind_of(one.kind.dtype)], array.numpy())
    if program.text.has_mesh and triangles is not None and len(triangles):
        boxes, leaves = triangle_tree.build(triangles)
        corners = np.asarray(triangles, np.float32)[leaves.ravel()]
        faces = np.zeros((*corners.shape[:2], 1), np.float32)
        faces[:, 0, 0] = leaves.ravel()
        record["leaf_count"] = len(leaves)
        record["boxes_first"] = _append(parts, "vectors", boxes.reshape(-1, 3))
        record["corners_first"] = _append(parts, "vectors", np.concatenate([corners, faces], axis=2).reshape(-1, 4))
    textures = {name: _texture(found, *_FORMATS[name]) for name, found in parts.items()}
    return KernelOnGPU(program, textures, record)


def _value_of(given, one):
    """Return the value of a `glsl_text.Given`."""
    value = given[one.path[0]]
    for name in one.path[1:]:
        value = getattr(value, name)
    return value


def _numbers(value):
    return value if np.isscalar(value) else list(value)


def _append(parts, texture, values):
    """Append elements to those of a texture; returns the index of the first."""
    channels = _FORMATS[texture][1]
    if texture == "words":
        bits = np.ascontiguousarray(values).astype(np.int64).ravel() & 0xFFFFFFFF
        texels = np.stack([bits >> 16, bits & 0xFFFF], axis=1)
    else:
        texels = values.reshape(-1, values.shape[-1] if texture == "vectors" else 1)
        texels = np.pad(texels, ((0, 0), (0, channels - texels.shape[1])))
    first = sum(len(part) for part in parts[texture])
    parts[texture].append(texels.astype(np.float32))
    return first


def _texture(parts, texture_format, channels):
    """Return a texture of all elements in rows of TEXTURE_WIDTH."""
    texels = np.concatenate([np.zeros((0, channels), np.float32), *parts])
    height = max(-(-len(texels) // TEXTURE_WIDTH), 1)
    texels = np.pad(texels, ((0, height * TEXTURE_WIDTH - len(texels)), (0, 0)))
    return driver_textures.new_texture((TEXTURE_WIDTH, height), texture_format, texels)


def _empty(count, kind):
    """Return an image of zeros for the values that threads write."""
    texture_format, channels = _FORMATS[_TEXTURE_OF[kind]]
    size = TEXTURE_WIDTH, max(-(-count // TEXTURE_WIDTH), 1)
    return driver_textures.new_texture(size, texture_format, np.zeros(size[0] * size[1] * channels, np.float32))


def _read(image, count, kind):
    """Return the first `count` elements of an image."""
    channels = _FORMATS[_TEXTURE_OF[kind]][1]
    texels = np.array(image.read(), np.float32).reshape(-1, channels)[:count]
    if _TEXTURE_OF[kind] == "words":
        bits = texels.astype(np.uint32)
        return ((bits[:, 0] << np.uint32(16)) | bits[:, 1]).view(np.int32 if kind == "int" else np.uint32)
    return texels[:, :3] if kind == "vec3" else texels if kind == "vec4" else texels[:, 0]


@shaders.cached
def _program(kernel: wp.Kernel) -> _Program:
    text = glsl_text.kernel_text(kernel)
    sides = {f"{name}_side_{axis}": "int" for name, one in text.arrays.items() for axis in range(one.kind.ndim)}
    places = {f"{name}_first": "int" for name in (*text.arrays, "boxes", "corners")}
    members = {name: one.kind for name, one in text.members.items()}
    own = dict.fromkeys(("first", "leaf_count", "thread_count"), "int")
    block = uniforms.Block("Given", {**members, **sides, **places, **own})
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    info.typedef_source(block.source)
    info.uniform_buf(0, "Given", "given")
    for slot, name in enumerate(_FORMATS):
        info.sampler(slot, "FLOAT_2D", name)
    for slot, (name, kind) in enumerate(text.written.items()):
        info.image(slot, _FORMATS[_TEXTURE_OF[kind]][0], "FLOAT_2D", name, qualifiers={"WRITE"})
    info.define("ROW", str(TEXTURE_WIDTH))
    info.define("LEAF_TRIANGLES", str(triangle_tree.LEAF_TRIANGLES))
    replaced = {} if text.has_mesh else {"kernels/mesh_query.glsl": None}
    shader = shaders.compile_compute(info, "kernels/kernel.comp", replaced, {"kernel_text.glsl": text.source})
    return _Program(shader, block, text)
