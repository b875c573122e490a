# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands on the GPU: points, radii and random numbers in textures.

A change costs one upload, or only that of the moved strands; a redraw costs none.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import gpu
import numpy as np

from . import shaders

# Widest row of the strand texture; every driver takes 16384 texels.
TEXTURE_WIDTH = 16384

# Work groups along an axis: every driver takes as many.
MOST_GROUPS = 65535

_SAMPLED = 500  # strands whose lengths are compared

_AT_ONCE = 400  # strands of which all points are gone through at once
_POINTS_AT_ONCE = 16_400  # that are brought into the order of texels

_MOVE_GROUP_SIZE = 64  # points that one work group of `_move_program` brings to their places


@dataclass(frozen=True)
class Moved:
    """What the last `move_strands` did: where the strands that it moved were before."""

    points: gpu.types.GPUTexture  # of each moved strand a texel that means nothing, and its points
    row_strands: int  # of that texture
    rows: gpu.types.GPUTexture  # of each of all strands: which of the moved it is, counted from one; 0: none
    turn: int  # how many such changes there were


@dataclass(frozen=True)
class StrandsOnGPU:
    """Points and radii of strands in a texture, with the strip that draws them."""

    texture: gpu.types.GPUTexture
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


def upload_strands(points, radii, randoms=None, wetness=None):
    """(S, P, 3) points and (S, P) radii, float32, in one coordinate system → `StrandsOnGPU`.

    randoms: (S,) numbers in [0, 1] by which strands may differ; without them all are average; wetness: (S,) in [0, 1],
    None where strands do not differ in it.
    """
    strand_count, point_count, _xyz = points.shape
    row_strands = TEXTURE_WIDTH // point_count
    texture = places_texture(points, radii, row_strands)
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
    data = gpu.types.Buffer("FLOAT", numbers.size, numbers.ravel())
    texture = gpu.types.GPUTexture(numbers.shape[::-1], format="R32F", data=data)
    texture.filter_mode(False)
    return texture


def places_texture(points, radii, row_strands):
    """(S, P, 3) places and (S, P) radii in a texture, each row of it `row_strands` whole strands."""
    strand_count, point_count, _xyz = points.shape
    row_count = -(-strand_count // row_strands)
    texels = np.empty((row_count * row_strands, point_count, 4), np.float32)
    texels[strand_count:] = 0.0
    # Number by number, of as many strands as the processor's caches hold: half the time of all at once.
    at_once = max(1, _POINTS_AT_ONCE // point_count)
    for first in range(0, strand_count, at_once):
        some = slice(first, min(first + at_once, strand_count))
        for axis in range(3):
            texels[some, :, axis] = points[some, :, axis]
        texels[some, :, 3] = radii[some]
    texture = gpu.types.GPUTexture(
        (row_strands * point_count, row_count),
        format="RGBA32F",
        data=gpu.types.Buffer("FLOAT", texels.size, texels.ravel()),
    )
    texture.filter_mode(False)
    return texture


def like(texture):
    """A texture of the same size for other strands, with nothing in it."""
    other = gpu.types.GPUTexture((texture.width, texture.height), format="RGBA32F")
    other.filter_mode(False)
    return other


def seen_points(point_count):
    """Texels of a strand in the visibility textures: SEEN_STEP of shaders/include/strand.glsl, and the tip."""
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
    heads = np.zeros((len(moved), 1, 3), np.float32)
    heads[:, 0, 0] = moved  # exact in single precision up to 16 million
    row_strands = TEXTURE_WIDTH // (strands.point_count + 1)
    texture = places_texture(
        np.concatenate([heads, points], axis=1), np.pad(strands.radii[moved], ((0, 0), (1, 0))), row_strands
    )
    turn, rows = (strands.moved.turn, strands.moved.rows) if strands.moved else (0, _no_rows(strands))
    rows.clear(format="FLOAT", value=(0.0,))
    program = _move_program()
    program.bind()
    for name, image in (("strands", strands.texture), ("moved_strands", texture), ("moved_rows", rows)):
        program.image(name, image)
    program.uniform_int("moved_count", len(moved))
    program.uniform_int("point_count", strands.point_count)
    program.uniform_int("row_strands", strands.row_strands)
    program.uniform_int("moved_row_strands", row_strands)
    groups = -(-len(moved) * strands.point_count // _MOVE_GROUP_SIZE)
    rows_of_groups = -(-groups // MOST_GROUPS)
    gpu.compute.dispatch(program, -(-groups // rows_of_groups), rows_of_groups, 1)
    return replace(strands, moved=Moved(texture, row_strands, rows, turn + 1), lengthenings={}, is_made=False)


def _no_rows(strands):
    return numbers_texture(np.zeros(strands.strand_count), strands.row_strands)


@shaders.kept
def _move_program():
    """The compute program that exchanges the points of some strands with those in the texture of all."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_MOVE_GROUP_SIZE)
    for slot, name in enumerate(("strands", "moved_strands")):
        info.image(slot, "RGBA32F", "FLOAT_2D", name, qualifiers={"READ", "WRITE"})
    info.image(2, "R32F", "FLOAT_2D", "moved_rows", qualifiers={"WRITE"})
    for name in ("moved_count", "point_count", "row_strands", "moved_row_strands"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "move_strands.comp")


def vertex_count(strand_count, drawn_points):
    """Vertices of a strip through strands: two a point, and one repeated at either end so that strands do not join."""
    return strand_count * (2 * drawn_points + 2)


def bare_vertices(count, primitive="TRI_STRIP"):
    """A batch of vertices without attributes."""
    return gpu.types.GPUBatch(type=primitive, buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), count))
