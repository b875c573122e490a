# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing of strands as strips into the bound framebuffer.

Strands are camera-facing strips without vertex attributes: the vertex shader fetches points from a texture.
"""

import functools
import math
import threading
from contextlib import contextmanager
from dataclasses import dataclass

import gpu
import numpy as np

from . import windows
from .programs import scene_programs, shaders, uniforms
from .strand_textures import bare_vertices, run_for_each, vertex_count


@dataclass(frozen=True)
class Steps:
    """Level of detail: the number of points drawn per strand, the number of strands drawn, and the first index.

    Both numbers may be arrays (N,), for N linked hair objects; thickness: factor of the strands' width; most_strands:
    maximum number of strands with any level of detail, None for all.
    """

    point_count: int | np.ndarray | None = None
    strand_count: int | np.ndarray | None = None
    first_strand: int = 0
    thickness: float = 1.0
    most_strands: int | None = None


_ALL = Steps()
_LEAST_RADIUS = 1e-6  # [m]

# A render runs in parallel to the window, and both share programs and their uniforms: a lock serializes drawing.
ALONE = threading.RLock()


def view_record(world_to_view, view_to_clip, height, least_width=0.0):
    """Return a `uniforms.VIEW` record of a camera.

    world_to_view, view_to_clip: (4, 4); height: of the picture [pixels]; least_width: minimum width of strands
    [pixels].
    """
    record = uniforms.VIEW.record()
    view_to_world = np.linalg.inv(world_to_view)
    record["world_to_clip"] = (view_to_clip @ world_to_view).T
    record["is_perspective"] = view_to_clip[3, 3] == 0.0
    record["is_mirrored"] = np.linalg.det(view_to_world[:3, :3]) < 0.0
    backwards = view_to_world[:3, 2]
    record["eye"][:3] = view_to_world[:3, 3] if record["is_perspective"] else backwards / np.linalg.norm(backwards)
    record["pixels_per_unit"] = 0.5 * height * view_to_clip[1, 1]
    a_unit = view_to_clip[2, 3] if record["is_perspective"] else view_to_clip[2, 2]
    record["depth_rise"] = 0.5 * abs(a_unit) / record["pixels_per_unit"]
    record["least_half_width"] = 0.5 * least_width / record["pixels_per_unit"]
    record["seen_opacity"] = 1.0  # the visibility of the world is computed without hair
    return record


def pass_shift(turn):
    """Return (2,) jitter [samples] of a pass, up to one half: a low-discrepancy sequence [Roberts18]."""
    return np.modf(turn * np.array([0.75487767, 0.56984029]) + 0.5)[0] - 0.5


def pass_record(world_to_view, view_to_clip, size, turn=0, tile=None):
    """Return the `view_record` of a pass over a picture; each pass moves the samples.

    size: (width, height) of the picture [samples]; turn: index of the pass, which is moved by `pass_shift`; tile:
    (left, bottom, width, height) [samples] of the part that is drawn.
    """
    left, bottom, width, height = tile or (0, 0, *size)
    shift, window = np.eye(4), np.eye(4)
    shift[:2, 3] = pass_shift(turn) * 2.0 / size
    window[0, 0], window[1, 1] = size[0] / width, size[1] / height
    window[0, 3] = (size[0] - 2.0 * left) / width - 1.0
    window[1, 3] = (size[1] - 2.0 * bottom) / height - 1.0
    record = view_record(world_to_view, window @ shift @ view_to_clip, height)
    record["sample_offset"] = 1.0
    record["coverage_turn"] = turn * 0.61803399 % 1.0
    record["first_column"], record["first_row"] = left, bottom
    return record


def scale_of(object_to_world):
    """Return the mean scale of a (4, 4) matrix, for radii."""
    # Written out, as it is called for each record of strands: a tenth of the time of NumPy's determinant.
    (a, b, c), (d, e, f), (g, h, i) = object_to_world[:3, :3].tolist()
    return abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)) ** (1.0 / 3.0)


def scales_of(to_world):
    """Return (N,) `scale_of` of (N, 4, 4) matrices."""
    (a, b, c), (d, e, f), (g, h, i) = to_world[:, :3, :3].transpose(1, 2, 0)
    return np.abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)) ** (1.0 / 3.0)


def bounding_sphere(hair):
    """Return (3,) center and radius [m] of a sphere around all strands; hair: [(StrandsOnGPU, object to world)].

    The radius is positive, also for hair that is scaled to a point.
    """
    corners = []
    for strands, to_world in hair:
        corners.append(windows.corners_of(strands.box.likely) @ to_world[:3, :3].T + to_world[:3, 3])
    corners = np.concatenate(corners)
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return centre, max(float(np.linalg.norm(corners - centre, axis=1).max()), _LEAST_RADIUS)


def bounding_spheres(strands, to_world):
    """Return (N, 3) centers and (N,) radii [m] of `bounding_sphere` around `StrandsOnGPU` at (N, 4, 4) places."""
    corners = windows.corners_of(strands.box.likely) @ to_world[:, :3, :3].transpose(0, 2, 1) + to_world[:, None, :3, 3]
    centres = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
    return centres, np.maximum(np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1), _LEAST_RADIUS)


def tight_sphere(hair):
    """`bounding_sphere` around strands instead of the corners of their boxes; tight for a single hair."""
    centres, radii = [], []
    for strands, to_world in hair:
        centre, radius = strands.ball
        centres.append(to_world[:3, :3] @ centre + to_world[:3, 3])
        radii.append(np.linalg.norm(to_world[:3, :3], 2) * radius)
    centres, radii = np.array(centres), np.array(radii)
    centre = 0.5 * ((centres - radii[:, None]).min(axis=0) + (centres + radii[:, None]).max(axis=0))
    return centre, max(float((np.linalg.norm(centres - centre, axis=1) + radii).max()), _LEAST_RADIUS)


def strand_record(strands, view, object_to_world, steps=_ALL):
    """Return a `uniforms.VIEW` record, completed for `StrandsOnGPU` at a place (4, 4)."""
    return strand_records(strands, view, np.asarray(object_to_world)[None], steps)[0]


def strand_records(strands, view, to_world, steps=_ALL):
    """Return (..., N) `strand_record`s of `StrandsOnGPU` at places (N, 4, 4) in (...) views; steps: with numbers or
    arrays that are broadcast to (..., N).
    """
    records, matrices = np.repeat(view[..., None], len(to_world), axis=-1), to_world.transpose(0, 2, 1)
    records["object_to_world"], records["object_to_clip"] = matrices, matrices @ view["world_to_clip"][..., None, :, :]
    records["object_scale"] = scales_of(to_world)
    records["strand_count"], records["point_count"] = strands.strand_count, strands.point_count
    for name, wanted, most in (
        ("drawn_strands", steps.strand_count, strands.strand_count),
        ("drawn_points", steps.point_count, strands.point_count),
    ):
        records[name] = most if wanted is None else np.minimum(wanted, most)
    records["first_strand"] = steps.first_strand
    records["part_size"], records["part_stride"] = _parts(strands.strand_count)
    records["thickness"] = steps.thickness * strands.strand_count / records["drawn_strands"]
    records["row_strands"] = strands.row_strands
    records["radius_strands"], records["radius_unit"] = strands.radius_strands, strands.radius_unit
    return records


# Maximum strands in a part: a shader multiplies their number by the stride in 32-bit integers.
_LARGEST_PART = 32_768


@functools.cache
def _parts(strand_count):
    """Return (size, stride) of the fewest equal parts of strands; the stride, near size times the golden ratio,
    visits all.
    """
    size = strand_count // -(-strand_count // _LARGEST_PART)
    stride = round(0.61803399 * size)
    while math.gcd(stride, size) != 1:
        stride += 1
    return size, stride


def draw_strip(strands, program, record, lights, samplers=None, clip_planes=None):
    """Draw `StrandsOnGPU` as strips into the bound framebuffer, by a program of `scene_programs.strip_program`.

    record: from `strand_record`; lights: a uniform buffer of `uniforms.LIGHTS`; samplers: {sampler: texture} of the
    program besides those of strands; clip_planes: (6, 4) for a program that is clipped.
    """
    count = vertex_count(int(record["drawn_strands"]), int(record["drawn_points"]))
    blocks = {"view": uniforms.uniform_buffer(record), "lights": lights, **uniforms.clipping_blocks(clip_planes)}
    with bound(program, blocks, {**strand_samplers(strands), **(samplers or {})}):
        strands.batch.draw_range(program, elem_count=count)


def strand_samplers(strands):
    """Return {sampler: texture} of `StrandsOnGPU` for programs that draw them."""
    return {"strands": strands.texture, "strand_radii": strands.radii_texture}


def runs_of_strand(record):
    """Number of runs of segments per strand; record: of `strand_record`."""
    return -(-(int(record["drawn_points"]) - 1) // scene_programs.RUN_LENGTH)


# The strands that `rasterize_strands` rasterizes, and the denominator of the first share: as in
# shaders/visibility/rasterize_segment.glsl.
WALK_ALL, WALK_FIRST, WALK_OTHERS = range(3)
FIRST_SHARE = 8


@contextmanager
def rasterizing(program, blocks, samplers, images, constants, part=WALK_ALL):
    """Bind a compute program that rasterizes segments, for all calls of `rasterize_strands` inside of the context.

    Binding takes longer than a dispatch.

    blocks: {instance: GPUUniformBuf} of all strands; samplers, images: {name: texture} that the program reads and
    writes; constants: {name: int}; part: `WALK_ALL` of the strands, `WALK_FIRST` or the remaining `WALK_OTHERS`.
    """
    with bound(program, blocks, samplers):
        for name, texture in images.items():
            program.image(name, texture)
        set_integers(program, constants)
        program.uniform_int("walked_part", part)
        yield


def rasterize_strands(strands, program, record, blocks, constants, part=WALK_ALL):
    """Rasterize strands with the program that `rasterizing` has bound; record: of `strand_record`.

    blocks: {instance: GPUUniformBuf} of these strands, the record as "view"; constants: {name: int} of these strands;
    part: as for `rasterizing`.
    """
    strand_count = int(record["drawn_strands"])
    first_count = -(-strand_count // FIRST_SHARE)
    walked = (strand_count, first_count, strand_count - first_count)[part]
    if not walked:
        return
    provide(program, blocks, strand_samplers(strands))
    set_integers(program, constants)
    run_for_each(program, walked * runs_of_strand(record), scene_programs.RUN_GROUP_SIZE)


def dispatch_over(program, size, group_size=(scene_programs.PICTURE_GROUP_SIZE,) * 2):
    """Run a bound compute program once for every texel of a picture; size, group_size: (width, height)."""
    width, height = (-(-length // threads) for length, threads in zip(size, group_size, strict=True))
    gpu.compute.dispatch(program, width, height, 1)


@contextmanager
def bound(program, blocks, samplers):
    """Bind a program with its blocks {instance: GPUUniformBuf} and textures {sampler: GPUTexture}.

    The program does not own them: they must live until the context exits. A bound program must not be freed: Blender
    would take a new program at the same address for bound, and draw with the old one.
    """
    program.bind()
    provide(program, blocks, samplers)
    yield
    gpu.shader.unbind()


def provide(program, blocks, samplers):
    """Set blocks {instance: GPUUniformBuf} and textures {sampler: GPUTexture} of a bound program."""
    for name, block in blocks.items():
        program.uniform_block(name, block)
    for name, texture in samplers.items():
        program.uniform_sampler(name, texture)


def set_integers(program, constants):
    """Set constants {name: int} of a bound program."""
    for name, value in constants.items():
        program.uniform_int(name, value)


def draw_cover(program, blocks, samplers):
    """Run a program once for every pixel of the bound framebuffer; blocks: {instance: record}."""
    with bound(program, {name: uniforms.uniform_buffer(record) for name, record in blocks.items()}, samplers):
        cover(program)


def resolve(picture, samples_per_side):
    """Fill the bound framebuffer with the mean of each block of samples_per_side² texels of a texture."""
    program = scene_programs.resolve_program()
    program.bind()
    program.uniform_int("samples_per_side", samples_per_side)
    program.uniform_sampler("picture", picture)
    with gpu_state("NONE", depth_writes=False):
        cover(program)


def cover(program):
    """Run a bound program whose vertex shader is picture/cover.vert over the whole framebuffer."""
    _cover_vertices().draw(program)


@shaders.cached  # cached like programs, as it is drawn several times for each light and frame
def _cover_vertices():
    return bare_vertices(3, "TRIS")


@contextmanager
def gpu_state(depth_test, depth_writes, blend="NONE"):
    """Set GPU state in a context, and restore it on exit."""
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


@contextmanager
def cleared(framebuffer, color, depth=1.0):
    """Bind a framebuffer, cleared to a color and depth."""
    with framebuffer.bind():
        framebuffer.clear(color=color, depth=depth)
        yield framebuffer
