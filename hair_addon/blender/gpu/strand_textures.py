# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands on the GPU: points, radii and random numbers in textures.

Points take eight bytes each: core/geometry/packed_strands.py.

A change costs one upload, or only that of the moved strands; a redraw costs none.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import gpu
import numpy as np

from ...core import geometry
from . import driver_textures, shaders

# Widest row of the strand texture; every driver takes 16384 texels.
TEXTURE_WIDTH = 16384

# Work groups along an axis: every driver takes as many.
MOST_GROUPS = 65535

_SAMPLED = 500  # strands whose lengths are compared

_AT_ONCE = 400  # strands of which all points are gone through at once

_MOVE_GROUP_SIZE = 64  # texels that one work group of `_move_program` brings to their places


@dataclass(frozen=True)
class Moved:
    """What the last `move_strands` did: where the strands that it moved were before."""

    points: gpu.types.GPUTexture  # of each moved strand a texel that means nothing, and its texels
    row_strands: int  # of that texture
    rows: gpu.types.GPUTexture  # of each of all strands: which of the moved it is, counted from one; 0: none
    turn: int  # how many such changes there were


@dataclass(frozen=True)
class StrandsOnGPU:
    """Points and radii of strands in textures, with the strip that draws them."""

    texture: gpu.types.GPUTexture  # of points, as core/geometry/packed_strands.py has them
    radii_texture: gpu.types.GPUTexture  # of one strand, where all have the same
    radius_strands: int  # whose radii are in it
    radius_unit: float  # that they are in it by
    batch: gpu.types.GPUBatch
    strand_count: int
    point_count: int
    row_strands: int
    randoms: gpu.types.GPUTexture  # a number in [0, 1] a strand, `row_strands` a row
    wetness: gpu.types.GPUTexture | None  # the same, None where strands do not differ
    wetness_here: np.ndarray | None  # (S,)
    points: np.ndarray  # (S, P, 3) as uploaded, for computations on the CPU
    radii: np.ndarray  # (S, P)
    bounds: np.ndarray  # (2, 3): least and greatest coordinates
    mean_length: float  # of strands, in the coordinate system of the points
    mean_radius: float
    greatest_radius: float
    randoms_here: np.ndarray | None = None  # (S,), None where all strands are average
    moved: Moved | None = None  # None where all points are as uploaded
    is_made: bool = False  # whether the GPU has made or carried them
    has_points: bool = True  # whether `points` are where strands are, which they are not while the GPU alone knows it
    lengthenings: dict = field(default_factory=dict)  # {number of points: how much longer strands are with all}

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All that it holds."""
        own = [self.texture, self.radii_texture, self.randoms]
        own += [] if self.wetness is None else [self.wetness]
        return own + ([] if self.moved is None else [self.moved.points, self.moved.rows])

    @cached_property
    def ball(self) -> tuple[np.ndarray, float]:
        """A centre (3,), and the greatest distance of a point from it: read from all points, for who needs it.

        That of a corner of the bounds where points are known to the GPU alone.
        """
        centre = 0.5 * self.bounds.sum(axis=0, dtype=np.float64)
        if not self.has_points:
            return centre, 0.5 * float(np.linalg.norm(np.ptp(self.bounds, axis=0).astype(np.float64)))
        return centre, _farthest(self.points, centre)

    def lengthening(self, point_count: int) -> float:
        """How much longer strands are than with as many points, evenly chosen of all: of some strands."""
        if point_count not in self.lengthenings:
            chosen = np.arange(point_count) * (self.point_count - 1) // (point_count - 1)
            some = self.points[:: -(-self.strand_count // _SAMPLED)]
            lengths = _total_length(some), _total_length(some[:, chosen])
            self.lengthenings[point_count] = lengths[0] / max(lengths[1], 1e-12)
        return self.lengthenings[point_count]

    def points_that_show(self, part: float) -> int:
        """How few of the points, evenly chosen, show the strands: with all, they are longer by at most this part.

        All of them where points are known to the GPU alone.
        """
        pieces, enough = self.point_count - 1, self.point_count
        steps = [step for step in range(2, pieces + 1) if pieces % step == 0] if self.has_points else []
        for step in steps:
            if self.lengthening(pieces // step + 1) > 1.0 + part:
                break
            enough = pieces // step + 1
        return enough


def upload_strands(points, radii, randoms=None, wetness=None):
    """(S, P, 3) points and (S, P) radii, float32, in one coordinate system → `StrandsOnGPU`.

    randoms: (S,) numbers in [0, 1] by which strands may differ; without them all are average; wetness: (S,) in [0, 1],
    None where strands do not differ in it.
    """
    strand_count, point_count, _xyz = points.shape
    row_strands = row_strands_of(point_count)
    texture = packed_texture(points, row_strands)
    random_texture = numbers_texture(np.full(strand_count, 0.5) if randoms is None else randoms, row_strands)
    wetness_texture = None if wetness is None else numbers_texture(wetness, row_strands)
    strip = bare_vertices(vertex_count(strand_count, point_count))
    # Strand by strand first: NumPy is ten times faster along the long axis of a flat array.
    flat = points.reshape(strand_count, -1)
    bounds = np.stack([flat.min(axis=0).reshape(-1, 3).min(axis=0), flat.max(axis=0).reshape(-1, 3).max(axis=0)])
    # A sample of the strands is enough for the level of detail.
    some = slice(None, None, -(-strand_count // 1000))
    mean_length = float(np.linalg.norm(np.diff(points[some], axis=1), axis=2).sum(axis=1).mean())
    return StrandsOnGPU(
        texture,
        *_radii_texture(radii, row_strands),
        strip,
        strand_count,
        point_count,
        row_strands,
        random_texture,
        wetness_texture,
        wetness,
        points,
        radii,
        bounds,
        mean_length,
        float(radii[some].mean()),
        float(radii.max()),
        randoms,
    )


def _total_length(points):
    return float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum())


def _farthest(points, centre):
    """Greatest distance of points (..., P, 3) from a centre (3,)."""
    flat, here, most = points.reshape(-1, points.shape[-2], 3), centre.astype(np.float32), 0.0
    for first in range(0, len(flat), _AT_ONCE):
        some = flat[first : first + _AT_ONCE] - here
        np.square(some, out=some)
        most = max(most, float((some[..., 0] + some[..., 1] + some[..., 2]).max()))
    return np.sqrt(most)


def numbers_texture(values, row_strands):
    """A number a strand, `row_strands` a row; values: (S,)."""
    numbers = np.zeros((-(-len(values) // row_strands), row_strands), np.float32)
    numbers.ravel()[: len(values)] = values
    return driver_textures.made(numbers.shape[::-1], "R32F", numbers)


def row_strands_of(point_count, others=0):
    """Whole strands in a row of a texture of packed strands, with so many other texels before each."""
    return TEXTURE_WIDTH // (others + geometry.packed_strands.texel_count(point_count))


def packed_texture(points, row_strands):
    """(S, P, 3) places in a texture, each row of it `row_strands` whole strands."""
    strand_count, point_count, _xyz = points.shape
    texel_count, row_count = geometry.packed_strands.texel_count(point_count), -(-strand_count // row_strands)
    texels = np.empty((row_count * row_strands, texel_count, 2), np.float32)
    texels[strand_count:] = 0.0
    geometry.packed_strands.pack(points, texels[:strand_count])
    return _texture("RG32F", row_strands * texel_count, texels)


_TEXEL_BYTES = {"RG32F": 8, "R32F": 4, "R16": 2, "RGBA32F": 16}
_MOST_OF_R16 = 65535  # steps from 0 to 1
_SEEN_BYTES = 20  # of a point in the visibility textures


def bytes_of(textures):
    """Memory of textures [bytes], each counted once."""
    by_id = {id(texture): texture for texture in textures}
    return sum(texture.width * texture.height * _TEXEL_BYTES[texture.format] for texture in by_id.values())


def seen_bytes(strands):
    """Memory of the visibility textures of `StrandsOnGPU` [bytes]."""
    return strands.texture.height * strands.row_strands * seen_points(strands.point_count) * _SEEN_BYTES


def with_radii(strands, radii):
    """`StrandsOnGPU` with other radii (S, P) float32, all else as it is."""
    texture, strand_count, unit = _radii_texture(radii, strands.row_strands)
    some = radii[:: -(-len(radii) // 1000)]
    return replace(
        strands,
        radii_texture=texture,
        radius_strands=strand_count,
        radius_unit=unit,
        radii=radii,
        mean_radius=float(some.mean()),
        greatest_radius=float(radii.max()),
    )


def _radii_texture(radii, row_strands):
    """(texture, strands in it, unit): radii (S, P) in two bytes each where strands differ, else of one for all."""
    strand_count, point_count = radii.shape
    if (radii == radii[:1]).all():
        return _texture("R32F", point_count, np.ascontiguousarray(radii[:1], np.float32)), 1, 1.0
    greatest = float(radii.max())
    # Infinite ones are kept as they are.
    texture_format, unit = ("R16", greatest) if np.isfinite(greatest) and greatest > 0.0 else ("R32F", 1.0)
    texels = np.zeros((-(-strand_count // row_strands) * row_strands, point_count), np.float32)
    np.divide(radii, unit, out=texels[:strand_count])
    if texture_format == "R16":
        _to_steps(texels)
    return _texture(texture_format, row_strands * point_count, texels), strand_count, unit


def _to_steps(numbers):
    """Make numbers in [0, 1], in place, such that the nearest ones of 16 bits come of them whatever the driver does.

    Blender's Vulkan cuts them off where OpenGL rounds: a quarter of a step more is the same step for either.
    """
    numbers *= np.float32(_MOST_OF_R16)
    np.rint(numbers, out=numbers)
    numbers += np.float32(0.25)
    numbers /= np.float32(_MOST_OF_R16)
    np.minimum(numbers, np.float32(1.0), out=numbers)


def _texture(texture_format, width, texels):
    channels = 2 if texture_format == "RG32F" else 1
    return driver_textures.made((width, texels.size // (channels * width)), texture_format, texels)


def like(texture):
    """A texture of the same size for other strands, with nothing in it."""
    return driver_textures.made((texture.width, texture.height), "RG32F")


def seen_points(point_count):
    """Texels of a strand in the visibility textures: SEEN_STEP of shaders/strands/strip.glsl, and the tip."""
    return -(-(point_count - 1) // 4) + 1


def move_strands(strands, moved, points):
    """Move some of the strands on the GPU, and return the `StrandsOnGPU` in place of these; uploads no others.

    Their arrays on this side are moved too. strands: `StrandsOnGPU`; moved: (M,) distinct indices; points: (M, P, 3)
    float32. Bounds only grow: they are exact again after the next `upload_strands`.
    """
    strands.points[moved] = points
    flat = points.reshape(-1, 3)
    strands.bounds[0] = np.minimum(strands.bounds[0], flat.min(axis=0))
    strands.bounds[1] = np.maximum(strands.bounds[1], flat.max(axis=0))
    texel_count, row_strands = (
        geometry.packed_strands.texel_count(strands.point_count),
        row_strands_of(strands.point_count, 1),
    )
    packed = np.empty((len(moved), texel_count, 2), np.float32)
    geometry.packed_strands.pack(points, packed)
    texels = np.zeros((-(-len(moved) // row_strands) * row_strands, 1 + texel_count, 2), np.float32)
    texels[: len(moved), 0, 0] = moved  # exact in single precision up to 16 million
    texels[: len(moved), 1:] = packed
    texture = _texture("RG32F", row_strands * (1 + texel_count), texels)
    turn, rows = (strands.moved.turn, strands.moved.rows) if strands.moved else (0, _no_rows(strands))
    rows.clear(format="FLOAT", value=(0.0,))
    before = like(texture)
    keep_strands(strands, before, len(moved), row_strands, texture)
    program = _move_program()
    program.bind()
    program.uniform_sampler("moved_strands", texture)
    for name, image in (("strands", strands.texture), ("moved_rows", rows)):
        program.image(name, image)
    _dispatch(program, {"moved_count": len(moved), "moved_row_strands": row_strands}, strands, len(moved))
    return replace(strands, moved=Moved(before, row_strands, rows, turn + 1), lengthenings={}, is_made=False)


def keep_strands(strands, kept, count, row_kept, listed=None):
    """Copy the texels of `StrandsOnGPU`, behind another one of each strand, to a texture of `row_kept` strands a row.

    count: of strands; listed: a texture like it, where the other texel is the index of the strand; None: all strands.
    """
    program = _keep_program()
    program.bind()
    program.uniform_sampler("strands", strands.texture)
    program.uniform_sampler("listed", strands.texture if listed is None else listed)
    program.image("kept_strands", kept)
    numbers = {"kept_count": count, "row_kept": row_kept, "is_list": int(listed is not None)}
    _dispatch(program, numbers, strands, count)


def run_for_each(program, count, group_size):
    """Run a bound compute program for each of `count` strands, segments or texels, `group_size` in a work group.

    Work groups beyond `MOST_GROUPS` stand in further rows, along y, of which the last may have some without work.
    """
    groups = -(-count // group_size)
    rows = -(-groups // MOST_GROUPS)
    gpu.compute.dispatch(program, -(-groups // rows), rows, 1)


def _dispatch(program, numbers, strands, count):
    """Run a bound program on each texel of so many strands."""
    texel_count = geometry.packed_strands.texel_count(strands.point_count)
    for name, value in (numbers | {"texel_count": texel_count, "row_strands": strands.row_strands}).items():
        program.uniform_int(name, value)
    run_for_each(program, count * texel_count, _MOVE_GROUP_SIZE)
    gpu.shader.unbind()


def _no_rows(strands):
    return numbers_texture(np.zeros(strands.strand_count), strands.row_strands)


@shaders.kept
def _move_program():
    """The compute program that brings the points of some strands into the texture of all."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_MOVE_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "moved_strands")
    info.image(0, "RG32F", "FLOAT_2D", "strands", qualifiers={"WRITE"})
    info.image(1, "R32F", "FLOAT_2D", "moved_rows", qualifiers={"WRITE"})
    for name in ("moved_count", "moved_row_strands", "texel_count", "row_strands"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/write_strands.comp")


@shaders.kept
def _keep_program():
    """The compute program that keeps where strands are. Metal cannot read images of this format that it writes."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_MOVE_GROUP_SIZE)
    for slot, name in enumerate(("strands", "listed")):
        info.sampler(slot, "FLOAT_2D", name)
    info.image(0, "RG32F", "FLOAT_2D", "kept_strands", qualifiers={"WRITE"})
    for name in ("kept_count", "row_kept", "is_list", "texel_count", "row_strands"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/previous_strands.comp")


def vertex_count(strand_count, drawn_points):
    """Vertices of a strip through strands: two a point, and one repeated at either end so that strands do not join."""
    return strand_count * (2 * drawn_points + 2)


def bare_vertices(count, primitive="TRI_STRIP"):
    """A batch of vertices without attributes."""
    return gpu.types.GPUBatch(type=primitive, buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), count))
