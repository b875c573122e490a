# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands + settings → pixels in whatever framebuffer is bound: the one drawing for viewport, picture and renderer.

Strands are camera-facing strips without vertex attributes: the vertex shader pulls points from a texture, so a change
costs one upload and a redraw none.
"""

from contextlib import contextmanager
from dataclasses import dataclass, field

import gpu
import numpy as np

from ..core.shading import albedo, dual_scattering, kajiya_kay, lookup_tables
from . import shaders, uniforms

# What the two modes of the Marschner model read; in the energy-conserving one M is evaluated.
_TABLES = {
    "classic": ("marschner.frag", ("m", "n", "n_trt")),
    "energy": ("energy_conserving.frag", ("n", "n_trt", "n_res")),
}

# Widest row of the strand texture; every driver takes 16384 texels.
_TEXTURE_WIDTH = 16384


@dataclass(frozen=True)
class StrandsOnGPU:
    """Points and radii of strands in a texture, with the strip that draws them."""

    texture: gpu.types.GPUTexture
    batch: gpu.types.GPUBatch
    strand_count: int
    point_count: int
    row_strands: int
    points: np.ndarray  # (S, P, 3) as they were uploaded, for what is computed on the processor
    radii: np.ndarray  # (S, P)
    bounds: np.ndarray  # (2, 3): least and greatest coordinates


@dataclass(frozen=True)
class Shading:
    """What a fragment shader needs on the GPU beside the scene."""

    program: gpu.types.GPUShader
    settings: gpu.types.GPUUniformBuf | None = None
    samplers: dict = field(default_factory=dict)
    albedo: np.ndarray = field(default_factory=lambda: np.zeros(3))  # answer to even light
    forward: np.ndarray = field(default_factory=lambda: np.zeros(3))  # passed on to strands behind


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
    vertex_count = _vertex_count(strand_count, point_count)
    # Strand by strand first: NumPy is ten times faster along the long axis of a flat array.
    flat = points.reshape(strand_count, -1)
    bounds = np.stack([flat.min(axis=0).reshape(-1, 3).min(axis=0), flat.max(axis=0).reshape(-1, 3).max(axis=0)])
    return StrandsOnGPU(texture, _strip(vertex_count), strand_count, point_count, row_strands, points, radii, bounds)


def _vertex_count(strand_count, drawn_points):
    """Two vertices a point, and one repeated at either end so that strands do not join."""
    return strand_count * (2 * drawn_points + 2)


def _strip(vertex_count, primitive="TRI_STRIP"):
    """A batch of vertices that carry nothing but their index."""
    return gpu.types.GPUBatch(type=primitive, buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), vertex_count))


def kajiya_kay_shading(settings):
    """The Kajiya-Kay model, ready to draw. The cylinder is opaque: half of what it scatters goes on."""
    program = shaders.strand_program("kajiya_kay.frag", kajiya_kay.Settings)
    scattered = kajiya_kay.mean_albedo(settings)
    return Shading(program, uniforms.uniform_buffer(uniforms.fill(settings)), {}, scattered, 0.5 * scattered)


def marschner_shading(tables):
    """The Marschner model from baked `lookup_tables.Tables`, ready to draw."""
    fragment, names = _TABLES[tables.settings.mode]
    textures = {f"{name}_table": _table_texture(getattr(tables, name)) for name in names}
    returned = albedo.mean_albedo(tables)
    if tables.settings.mode == "energy":
        dual = dual_scattering.bake(tables)
        returned = returned + dual_scattering.BACK_GAIN * dual_scattering.mean_back(dual)
        textures |= {
            "dual_table": _table_texture(dual.theta),
            "n_g_table": _table_texture(dual.n_g),
            "n_g_trt_table": _table_texture(dual.n_g_trt),
        }
    program = shaders.strand_program(fragment, lookup_tables.Settings, tuple(textures))
    settings = uniforms.uniform_buffer(uniforms.fill(tables.settings))
    return Shading(program, settings, textures, returned, albedo.mean_forward(tables))


def guide_shading():
    """Guides in a colour each, unlit."""
    return Shading(shaders.strand_program("guides.frag", shadow_samplers=()))


def depth_only():
    """Strands that leave nothing but their depth, in front of a pass that shades them."""
    return Shading(shaders.strand_program("depth_only.frag", shadow_samplers=()))


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


def scale_of(object_to_world):
    """The mean scale of a (4, 4) matrix: what a radius is multiplied by."""
    return abs(np.linalg.det(object_to_world[:3, :3])) ** (1.0 / 3.0)


def draw_strands(strands, shading, view, lights, object_to_world, shadow_maps=None, point_step=1, surface_color=0.0):
    """Draw `StrandsOnGPU` into the bound framebuffer.

    view, lights: records of `uniforms`; shadow_maps: {sampler: texture}, None for a shader that reads none;
    point_step: every how many-th point is drawn, for pictures too coarse to show them all; surface_color: linear RGB of
    what the hair grows on.
    """
    drawn_points = max(2, -(-strands.point_count // point_step))
    record = view.copy()
    record["object_to_world"] = object_to_world.T
    record["object_scale"] = scale_of(object_to_world)
    record["point_count"] = strands.point_count
    record["drawn_points"] = drawn_points
    record["row_strands"] = strands.row_strands
    record["hair_albedo"][:3] = shading.albedo
    record["hair_forward"][:3] = shading.forward
    record["surface_color"][:3] = surface_color
    record["back_gain"] = dual_scattering.BACK_GAIN
    samplers = {"strands": strands.texture, **shading.samplers, **(shadow_maps or {})}
    vertex_count = _vertex_count(strands.strand_count, drawn_points)
    _draw(strands.batch, shading.program, record, lights, samplers, shading.settings, vertex_count)


def draw_surface(surface, color, view, lights, shadow_maps):
    """Draw a matt surface; surface: a batch of `upload_surface`, color: linear RGB."""
    program = shaders.surface_program("surface.frag")
    program.bind()
    program.uniform_float("surface_color", color)
    _draw(surface, program, view, lights, shadow_maps)


def draw_surface_depth(surface, view, lights):
    """Draw a surface into a shadow map's first pass."""
    _draw(surface, shaders.surface_program("shadow_front.frag", shadow_samplers=()), view, lights, {})


def _draw(batch, program, view, lights, samplers, settings=None, vertex_count=0):
    program.bind()
    # The program does not hold its blocks: they have to live until the draw call is over.
    blocks = {"view": uniforms.uniform_buffer(view), "lights": uniforms.uniform_buffer(lights)}
    if settings is not None:
        blocks["settings"] = settings
    for name, block in blocks.items():
        program.uniform_block(name, block)
    for name, texture in samplers.items():
        program.uniform_sampler(name, texture)
    batch.draw_range(program, elem_count=vertex_count)  # zero: all there are


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
    with gpu_state("NONE", depth_writes=False):
        _strip(3, "TRIS").draw(program)


@contextmanager
def gpu_state(depth_test, depth_writes, blend="NONE"):
    """Set what drawing depends on, for a while; what was set before comes back."""
    before = gpu.state.depth_test_get(), gpu.state.depth_mask_get(), gpu.state.blend_get()
    gpu.state.face_culling_set("NONE")
    try:
        gpu.state.depth_test_set(depth_test)
        gpu.state.depth_mask_set(depth_writes)
        gpu.state.blend_set(blend)
        yield
    finally:
        gpu.state.depth_test_set(before[0])
        gpu.state.depth_mask_set(before[1])
        gpu.state.blend_set(before[2])
