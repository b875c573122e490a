# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands interpolated from their guides by compute programs, in the texture from which they are drawn.

Bindings of strands are uploaded once. An edit of guides only uploads the guides, and only bounds are read back.
core/interpolation documents the mathematics; shaders/strands/interpolate_strands.comp implements the same.
"""

from dataclasses import dataclass, replace

import gpu
import numpy as np

from ....core.interpolation.hair_binding import SPREAD, HairBinding
from ....core.kernels.checks import require_count, require_indices
from ..programs import shaders, uniforms
from ..strand_textures import TEXTURE_WIDTH, StrandsOnGPU, row_strands_of, run_for_each
from .strand_changes import StrandChanges, declare_written, empty_rows, new_changes, rows_texture

_GROUP_SIZE = 64


@dataclass(frozen=True)
class StrandMaker:
    """`BoundStrands` on the GPU, without the points of guides; made by `new_maker`."""

    bindings: gpu.types.GPUTexture  # for each strand its root, its normal, and its guides with weights
    guide_normals: gpu.types.GPUTexture  # and 1 / the number of points up to a guide's tie, or 0
    segments: gpu.types.GPUTexture  # of guides, in the frames of their roots; then limits of weights, and roots
    changes: StrandChanges | None  # None if strands are made for styles
    record: np.ndarray  # uniforms.MAKING
    block: gpu.types.GPUUniformBuf
    slot_count: int  # guides per strand

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        own = [self.bindings, self.guide_normals, self.segments]
        return own + ([] if self.changes is None else self.changes.textures)

    def make(
        self, strands: StrandsOnGPU, guide_points: np.ndarray, rest: gpu.types.GPUTexture | None = None
    ) -> StrandsOnGPU:
        """Make all strands for guides (G, P, 3) float32, in the coordinates of roots; returns the new `StrandsOnGPU`.

        strands: with the same roots; their texture is changed, and of the arrays on the CPU only the bounds; rest: a
        texture to fill instead, with strands at rest that are deformed later. Raises `HairError` if counts do not
        match.
        """
        self.require_fitting(strands)
        if rest is None:
            self.changes.keep(strands)
        self.put_guides(guide_points)
        self.fill(strands.texture if rest is None else rest)
        return self.changes.changed(strands) if rest is None else strands

    def require_fitting(self, strands: StrandsOnGPU) -> None:
        """Raise `HairError` unless the numbers of strands and points match."""
        require_count("strands", strands.strand_count, int(self.record["strand_count"]))
        require_count("points of a strand", strands.point_count, int(self.record["point_count"]))

    def fill(self, texture: gpu.types.GPUTexture) -> None:
        """Make all strands in a texture like `StrandsOnGPU.texture`, for the guides of the last `put_guides`."""
        self.fill_some(texture, 0, int(self.record["strand_count"]))

    def fill_some(self, texture: gpu.types.GPUTexture, first: int, count: int) -> None:
        """`fill` for some consecutive strands, the first at the start of the texture."""
        program = _strands_program(self.slot_count, self.changes is None)
        program.bind()
        program.uniform_block("making", self.block)
        for name in ("bindings", "guide_normals", "segments"):
            program.uniform_sampler(name, getattr(self, name))
        program.image("strands", texture)
        if self.changes is not None:
            self.changes.bind(program)
        program.uniform_int("first_strand", first)
        program.uniform_int("some_count", count)
        run_for_each(program, count, _GROUP_SIZE)
        gpu.shader.unbind()

    def limited(self, fading: tuple[float, float, float, float], keep_length: float) -> "StrandMaker":
        """Return a maker with other `BoundStrands.fading` and `keep_length`: only a record is uploaded."""
        record = self.record.copy()
        record["limits"], record["keep_length"] = fading, keep_length
        return replace(self, record=record, block=uniforms.uniform_buffer(record))

    def weighed(self, bound: "BoundStrands") -> "StrandMaker":
        """Return a maker with other guides or weights of the same strands. Raises `HairError` like `new_maker`."""
        require_count("strands", len(bound.roots), int(self.record["strand_count"]))
        require_count("guides", len(bound.guide_normals), int(self.record["guide_count"]))
        record, slot_count = self.record.copy(), bound.indices.shape[1]
        _strands_program(slot_count, self.changes is None)
        bindings, record["row_bindings"] = rows_texture(_binding_rows(bound), 4)
        block = uniforms.uniform_buffer(record)
        return replace(self, bindings=bindings, record=record, block=block, slot_count=slot_count)

    def put_guides(self, guide_points: np.ndarray) -> None:
        """Upload guides (G, P, 3) and compute their segments."""
        require_count("guides", len(guide_points), int(self.record["guide_count"]))
        require_count("points of a guide", guide_points.shape[1], int(self.record["point_count"]))
        values = np.ascontiguousarray(guide_points, np.float32).reshape(len(guide_points), -1)
        points, _row = rows_texture(values, 1)
        program = _segments_program()
        program.bind()
        program.uniform_block("making", self.block)
        program.uniform_sampler("guide_points", points)
        program.uniform_sampler("guide_normals", self.guide_normals)
        program.image("segments", self.segments)
        gpu.compute.dispatch(program, -(-len(values) // _GROUP_SIZE), 1, 1)
        gpu.shader.unbind()


@dataclass(frozen=True)
class BoundStrands:
    """S strands and their bindings to G guides, as arrays on the CPU: the contents of `HairBinding`."""

    roots: np.ndarray  # (S, 3) float32 [m]
    normals: np.ndarray  # (S, 3) float32, unit
    guide_normals: np.ndarray  # (G, 3) float32, unit
    tie_fractions: np.ndarray  # (G,) float32 as in `interpolation.interpolate`
    indices: np.ndarray  # (S, k) int32, -1 for none
    weights: np.ndarray  # (S, k) float32, before guides that differ too much are left out
    fading: tuple[float, float, float, float]  # `Limits.fading`
    keep_length: float


def bound_strands(binding: HairBinding) -> BoundStrands:
    """Return the `BoundStrands` of a `HairBinding`."""
    weights = binding.guide_weights
    arrays = (binding.positions, binding.normals, binding.guide_normals, weights.indices, weights.weights)
    roots, normals, guide_normals, indices, shares = (array.numpy() for array in arrays)
    none = np.zeros(len(guide_normals), np.float32)
    tie_fractions = none if binding.tie_fractions is None else binding.tie_fractions.numpy()
    return BoundStrands(
        roots, normals, guide_normals, tie_fractions, indices, shares, binding.limits.fading, binding.keep_length
    )


def programs_of(slot_count: int, is_plain: bool) -> list[tuple]:
    """Programs of a `StrandMaker`, for `shaders.compile_one`; is_plain: as for `new_maker`."""
    return [(_segments_program, ()), (_strands_program, (slot_count, is_plain))]


def new_maker(bound: BoundStrands, point_count: int, axes: np.ndarray, is_plain: bool = False) -> StrandMaker:
    """Return the `StrandMaker` of `BoundStrands`, without styles; guides and strands have `point_count` points.

    axes: (3, 3), from the coordinates of roots and guides to those of the strands; is_plain: make strands in single
    precision, for styles. Raises `HairError` if counts or indices do not match, or the driver does not support it.
    """
    bindings = _binding_rows(bound)
    record = uniforms.MAKING.record()
    record["axes"][:3, :3], record["axes"][3, 3] = np.asarray(axes).T, 1.0
    record["axes_scale"] = np.linalg.norm(axes, 2)
    record["limits"], record["keep_length"] = bound.fading, bound.keep_length
    strand_count, guide_count = len(bound.roots), len(bound.guide_normals)
    record["strand_count"], record["guide_count"], record["point_count"] = strand_count, guide_count, point_count
    record["row_guides"] = TEXTURE_WIDTH // (3 * point_count)
    record["row_strands"] = TEXTURE_WIDTH // point_count if is_plain else row_strands_of(point_count)
    # Programs first: if they are not supported, nothing is uploaded.
    slot_count = bound.indices.shape[1]
    _segments_program(), _strands_program(slot_count, is_plain)
    bindings_texture, record["row_bindings"] = rows_texture(bindings, 4)
    require_count("ties of guides", len(bound.tie_fractions), guide_count)
    per_point = np.zeros(guide_count, np.float32)
    np.divide(1.0, bound.tie_fractions * max(point_count - 1, 1), out=per_point, where=bound.tie_fractions > 0.0)
    rows = np.concatenate([bound.guide_normals, per_point[:, None]], axis=1)
    normals_texture, record["row_normals"] = rows_texture(rows, 4)
    segments, record["row_segments"] = empty_rows(guide_count, point_count + 2)
    changes = None if is_plain else new_changes(strand_count, point_count)
    block = uniforms.uniform_buffer(record)
    return StrandMaker(bindings_texture, normals_texture, segments, changes, record, block, slot_count)


def _binding_rows(bound):
    """Return (S, 4 T) float32, T texels per strand: see shaders/strands/interpolate_strands.comp."""
    strand_count, slot_count = bound.indices.shape
    require_count("strands", len(bound.roots), strand_count)
    require_count("normals", len(bound.normals), strand_count)
    require_count("weights", bound.weights.size, bound.indices.size)
    is_used = bound.indices >= 0
    require_indices("guides", bound.indices[is_used], len(bound.guide_normals))
    rows = np.zeros((strand_count, 2 + -(-slot_count // 2), 4), np.float32)
    rows[:, 0, :3], rows[:, 1, :3] = bound.roots, bound.normals
    pairs = rows[:, 2:].reshape(strand_count, -1, 2)
    pairs[:, :slot_count, 0] = np.where(is_used, bound.indices, 0)  # exact in single precision up to 16 million
    pairs[:, :slot_count, 1] = np.where(is_used, bound.weights, 0.0)
    return rows.reshape(strand_count, -1)


def _declared(samplers):
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    info.typedef_source(uniforms.MAKING.source)
    info.uniform_buf(0, "Making", "making")
    for slot, name in enumerate(samplers):
        info.sampler(slot, "FLOAT_2D", name)
    return info


@shaders.cached
def _segments_program():
    """Return the compute program that transforms guides into the frames of their roots."""
    info = _declared(("guide_points", "guide_normals"))
    info.image(0, "RGBA32F", "FLOAT_2D", "segments", qualifiers={"WRITE"})
    return shaders.compile_compute(info, "strands/guide_segments.comp")


@shaders.cached
def _strands_program(slot_count, is_plain):
    """Return the compute program that makes strands of `slot_count` guides each; is_plain: as for `new_maker`."""
    info = _declared(("bindings", "guide_normals", "segments"))
    info.define("SLOTS", str(slot_count))
    info.define("SPREAD", repr(SPREAD))
    for name in ("first_strand", "some_count"):
        info.push_constant("INT", name)
    if not is_plain:
        declare_written(info, first_slot=0)
        return shaders.compile_compute(info, "strands/interpolate_strands.comp")
    info.image(0, "RGBA32F", "FLOAT_2D", "strands", qualifiers={"WRITE"})
    replaced = {"strands/write_packed_strand.glsl": "strands/write_plain_strand.glsl"}
    return shaders.compile_compute(info, "strands/interpolate_strands.comp", replaced)
