# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands + settings → pixels in whatever framebuffer is bound: the one drawing for viewport, picture and renderer.

Strands are camera-facing strips without vertex attributes: the vertex shader pulls points from a texture, so a change
costs one upload and a redraw none.
"""

from dataclasses import dataclass, field

import gpu
import numpy as np

from ..core.shading import albedo, kajiya_kay, lookup_tables
from . import shaders, uniforms

TABLE_NAMES = ("m_table", "n_table", "n_trt_table")

# Widest row of the strand texture; every driver takes 16384 texels.
_TEXTURE_WIDTH = 16384


@dataclass(frozen=True)
class StrandsOnGPU:
    """Points and radii of strands in a texture, with the strip that draws them."""

    texture: gpu.types.GPUTexture
    batch: gpu.types.GPUBatch
    point_count: int
    row_strands: int


@dataclass(frozen=True)
class Shading:
    """What a shading model needs on the GPU beside the scene: program, settings, tables, response to even light."""

    program: gpu.types.GPUShader
    settings: gpu.types.GPUUniformBuf | None
    tables: dict
    albedo: np.ndarray = field(default_factory=lambda: np.zeros(3))  # for models that cannot tell it themselves


def upload_strands(points, radii):
    """(S, P, 3) points and (S, P) radii, float32, in one coordinate system → `StrandsOnGPU`."""
    strand_count, point_count, _xyz = points.shape
    row_strands = _TEXTURE_WIDTH // point_count
    row_count = -(-strand_count // row_strands)
    texels = np.zeros((row_count * row_strands, point_count, 4), np.float32)
    texels[:strand_count, :, :3] = points
    texels[:strand_count, :, 3] = radii
    texture = gpu.types.GPUTexture(
        (row_strands * point_count, row_count),
        format="RGBA32F",
        data=gpu.types.Buffer("FLOAT", texels.size, texels.ravel()),
    )
    texture.filter_mode(False)
    # Two vertices a point, and one repeated at either end so that strands do not join.
    vertex_count = strand_count * (2 * point_count + 2)
    return StrandsOnGPU(texture, _strip(vertex_count), point_count, row_strands)


def _strip(vertex_count, primitive="TRI_STRIP"):
    """A batch of vertices that carry nothing but their index."""
    return gpu.types.GPUBatch(type=primitive, buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), vertex_count))


def kajiya_kay_shading(settings):
    """The Kajiya-Kay model, ready to draw."""
    program = shaders.strand_program("kajiya_kay.frag", kajiya_kay.Settings)
    return Shading(program, uniforms.uniform_buffer(uniforms.fill(settings)), {})


def marschner_shading(tables):
    """The Marschner model from baked `lookup_tables.Tables`, ready to draw."""
    program = shaders.strand_program("marschner.frag", lookup_tables.Settings, TABLE_NAMES)
    arrays = (tables.m, tables.n, tables.n_trt)
    textures = {name: _table_texture(array) for name, array in zip(TABLE_NAMES, arrays, strict=True)}
    settings = uniforms.uniform_buffer(uniforms.fill(tables.settings))
    return Shading(program, settings, textures, albedo.mean_albedo(tables))


def guide_shading():
    """Guides in a colour each, unlit."""
    return Shading(shaders.strand_program("guides.frag"), None, {})


def _table_texture(array):
    height, width, channel_count = array.shape
    texels = np.zeros((height, width, 4), np.float32)
    texels[..., :channel_count] = array
    texture = gpu.types.GPUTexture(
        (width, height), format="RGBA16F", data=gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    )
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    return texture


def view_record(world_to_view, view_to_clip, height, least_width=0.0):
    """A `uniforms.VIEW` record of a camera.

    world_to_view, view_to_clip: (4, 4); height: of the picture [pixels]; least_width: strands thinner than this many
    pixels are drawn that wide.
    """
    record = uniforms.VIEW.record()
    view_to_world = np.linalg.inv(world_to_view)
    record["world_to_clip"] = (view_to_clip @ world_to_view).T
    record["is_perspective"] = view_to_clip[3, 3] == 0.0
    record["eye"][:3] = view_to_world[:3, 3] if record["is_perspective"] else view_to_world[:3, 2]
    record["least_half_width"] = least_width / (height * view_to_clip[1, 1])
    return record


def draw_strands(strands, shading, view, lights, object_to_world):
    """Draw `StrandsOnGPU` with depth test and depth writes; view and lights are records of `uniforms`."""
    record = view.copy()
    record["object_to_world"] = object_to_world.T
    record["object_scale"] = abs(np.linalg.det(object_to_world[:3, :3])) ** (1.0 / 3.0)
    record["point_count"] = strands.point_count
    record["row_strands"] = strands.row_strands
    record["hair_albedo"][:3] = shading.albedo
    program = shading.program
    program.bind()
    blocks = _bind_scene(program, record, lights)
    if shading.settings is not None:
        program.uniform_block("settings", shading.settings)
    program.uniform_sampler("strands", strands.texture)
    for name, texture in shading.tables.items():
        program.uniform_sampler(name, texture)
    with _opaque():
        strands.batch.draw(program)
    del blocks


def draw_surface(triangles, color, view, lights):
    """Draw a matt surface; triangles: a batch of `upload_surface`, color: linear RGB."""
    program = shaders.surface_program()
    program.bind()
    blocks = _bind_scene(program, view, lights)
    program.uniform_float("surface_color", color)
    with _opaque():
        triangles.draw(program)
    del blocks


def _bind_scene(program, view, lights):
    """Bind both blocks of the scene; they must outlive the draw call, as the program does not hold them."""
    blocks = uniforms.uniform_buffer(view), uniforms.uniform_buffer(lights)
    program.uniform_block("view", blocks[0])
    program.uniform_block("lights", blocks[1])
    return blocks


def upload_surface(positions, normals):
    """(3 F, 3) float32 corner positions and unit normals in world space → a batch of triangles."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="position", comp_type="F32", len=3, fetch_mode="FLOAT")
    layout.attr_add(id="normal", comp_type="F32", len=3, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, len(positions))
    # Anything but contiguous float32 would be taken without complaint and drawn as rubbish.
    vertices.attr_fill("position", np.ascontiguousarray(positions, np.float32))
    vertices.attr_fill("normal", np.ascontiguousarray(normals, np.float32))
    return gpu.types.GPUBatch(type="TRIS", buf=vertices)


def resolve(picture, samples_per_side):
    """Fill the bound framebuffer with the mean of each block of samples_per_side² texels of a texture."""
    program = shaders.resolve_program()
    program.bind()
    program.uniform_int("samples_per_side", samples_per_side)
    program.uniform_sampler("picture", picture)
    gpu.state.depth_test_set("NONE")
    _strip(3, "TRIS").draw(program)


class _opaque:
    """Depth test and writes on, no blending, no culling; what was set before comes back."""

    def __enter__(self):
        self.before = gpu.state.depth_test_get(), gpu.state.depth_mask_get(), gpu.state.blend_get()
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        gpu.state.blend_set("NONE")
        gpu.state.face_culling_set("NONE")

    def __exit__(self, *_error):
        depth_test, depth_mask, blend = self.before
        gpu.state.depth_test_set(depth_test)
        gpu.state.depth_mask_set(depth_mask)
        gpu.state.blend_set(blend)
