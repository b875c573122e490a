# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands on the GPU: points, radii and random numbers in textures.

Points take eight bytes each: core/geometry/packed_strands.py.

A change uploads all strands, or only the moved strands; a redraw uploads nothing.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import gpu
import numpy as np

from ...core import geometry
from ...core.shading.strand_looks import StrandLooks
from . import driver_textures
from .programs import shaders
from .strand_box import StrandBox, known_box

# Maximum width of textures; every driver supports 16384 texels.
TEXTURE_WIDTH = 16384

# Maximum work groups along an axis; every driver supports as many.
MOST_GROUPS = 65535

_SAMPLED = 500  # strands whose lengths are compared

_AT_ONCE = 400  # strands processed at once

_MOVE_GROUP_SIZE = 64  # texels per work group of `_move_program`


@dataclass(frozen=True)
class Moved:
    """Former points of the strands that the last `move_strands` moved."""

    points: gpu.types.GPUTexture  # for each moved strand an unused texel, and its packed texels
    row_strands: int  # strands per row of that texture
    rows: gpu.types.GPUTexture  # for each strand its index among the moved strands, counted from one; 0: not moved
    turn: int  # number of changes so far


@dataclass(frozen=True)
class StrandsOnGPU:
    """Points and radii of strands in textures, with the strip that draws them."""

    texture: gpu.types.GPUTexture  # of points, in the format of core/geometry/packed_strands.py
    radii_texture: gpu.types.GPUTexture  # of a single strand, if all have the same radii
    radius_strands: int  # number of strands in `radii_texture`
    radius_unit: float  # unit of the radii in it
    batch: gpu.types.GPUBatch
    strand_count: int
    point_count: int
    row_strands: int
    randoms: gpu.types.GPUTexture  # a number in [0, 1] per strand, `row_strands` per row
    wetness: gpu.types.GPUTexture | None  # in the same layout; None if strands do not differ
    wetness_here: np.ndarray | None  # (S,) on the CPU
    points: np.ndarray  # (S, P, 3) as uploaded, for computations on the CPU
    radii: np.ndarray  # (S, P)
    box: StrandBox  # in the coordinate system of the points
    mean_length: float  # of strands, in the coordinate system of the points
    mean_radius: float
    greatest_radius: float
    randoms_here: np.ndarray | None = None  # (S,) on the CPU; None if all strands are average
    looks: gpu.types.GPUTexture | None = None  # two texels per strand, see fibre/mapped_strand.glsl; None without maps
    radial: gpu.types.GPUTexture | None = None  # radial roughness in the layout of `randoms`; None if it does not vary
    looks_here: StrandLooks | None = None  # (S,) on the CPU
    moved: Moved | None = None  # None if all points are as uploaded
    is_made: bool = False  # whether the GPU has computed or carried the strands
    has_points: bool = True  # whether `points` are current, and not only the texture
    has_bends: bool = True  # whether strands bend like `points`: they are current, or were only carried since
    lengthenings: dict = field(default_factory=dict)  # {number of points: length with all points / with that number}

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        own = [self.texture, self.radii_texture, self.randoms]
        own += [one for one in (self.wetness, self.looks, self.radial) if one is not None]
        return own + ([] if self.moved is None else [self.moved.points, self.moved.rows])

    @cached_property
    def shapes(self) -> dict:
        """Cache of level_of_detail.py: {key of places: shapes}; empty for changed strands."""
        return {}

    @property
    def ball(self) -> tuple[np.ndarray, float]:
        """A center (3,), and the greatest distance of all points from it.

        The distance of the corners of the likely box if only the GPU has the current points.
        """
        if self.has_points:
            return self._ball_of_points
        likely = self.box.likely.astype(np.float64)
        return 0.5 * likely.sum(axis=0), 0.5 * float(np.linalg.norm(np.ptp(likely, axis=0)))

    @cached_property
    def _ball_of_points(self):
        centre = 0.5 * self.box.exact.sum(axis=0, dtype=np.float64)
        return centre, _farthest(self.points, centre)

    def lengthening(self, point_count: int) -> float:
        """Length with all points divided by the length with `point_count` evenly chosen points, for some strands."""
        if point_count not in self.lengthenings:
            chosen = np.arange(point_count) * (self.point_count - 1) // (point_count - 1)
            some = self.points[:: -(-self.strand_count // _SAMPLED)]
            lengths = _total_length(some), _total_length(some[:, chosen])
            self.lengthenings[point_count] = lengths[0] / max(lengths[1], 1e-12)
        return self.lengthenings[point_count]


def upload_strands(points, radii, randoms=None, wetness=None, looks=None):
    """Return the `StrandsOnGPU` of points (S, P, 3) and radii (S, P), float32, in one coordinate system.

    randoms: (S,) numbers in [0, 1] for variation, None: all strands are average; wetness: (S,) in [0, 1], None if
    strands do not differ; looks: `StrandLooks` (S,), None without maps.
    """
    strand_count, point_count, _xyz = points.shape
    row_strands = row_strands_of(point_count)
    texture, bounds = packed_texture(points, row_strands)
    random_texture = numbers_texture(np.full(strand_count, 0.5) if randoms is None else randoms, row_strands)
    wetness_texture = None if wetness is None else numbers_texture(wetness, row_strands)
    strip = bare_vertices(vertex_count(strand_count, point_count))
    uploaded = StrandsOnGPU(
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
        known_box(bounds),
        _mean_length(points),
        float(radii[_some(strand_count)].mean()),
        float(radii.max()),
        randoms,
    )
    return with_looks(uploaded, looks)


def with_points(strands, points):
    """`StrandsOnGPU` with other points (S, P, 3) float32 of the same strands; only the points are uploaded."""
    texture, bounds = packed_texture(points, strands.row_strands)
    return replace(
        strands,
        texture=texture,
        points=points,
        box=known_box(bounds),
        mean_length=_mean_length(points),
        moved=None,
        is_made=False,
        has_points=True,
        has_bends=True,
        lengthenings={},
    )


def _some(strand_count):
    """Slice of a sample of the strands, which suffices for the level of detail."""
    return slice(None, None, -(-strand_count // 1000))


def _mean_length(points):
    return float(np.linalg.norm(np.diff(points[_some(len(points))], axis=1), axis=2).sum(axis=1).mean())


def with_looks(strands, looks):
    """`StrandsOnGPU` with other `StrandLooks`, or with None."""
    if looks is None:
        return strands if strands.looks is None else replace(strands, looks=None, radial=None, looks_here=None)
    count, row_strands = strands.strand_count, strands.row_strands
    texels = np.zeros((-(-count // row_strands) * row_strands, 2, 4), np.float32)
    for place, sigma_a in enumerate((looks.root, looks.tip)):
        np.minimum(sigma_a, _MOST_HALF, out=texels[:count, place, :3])
    np.minimum(looks.roughness, _MOST_HALF, out=texels[:count, 0, 3])
    texels[:count, 1, 3] = 0.5 if strands.randoms_here is None else strands.randoms_here
    texture = driver_textures.new_texture((2 * row_strands, len(texels) // row_strands), "RGBA16F", texels)
    radial = None if looks.radial is None else numbers_texture(looks.radial, row_strands)
    return replace(strands, looks=texture, radial=radial, looks_here=looks)


def _total_length(points):
    return float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum())


def _farthest(points, centre):
    """Greatest distance of points (..., P, 3) from a center (3,)."""
    flat, here, most = points.reshape(-1, points.shape[-2], 3), centre.astype(np.float32), 0.0
    for first in range(0, len(flat), _AT_ONCE):
        some = flat[first : first + _AT_ONCE] - here
        np.square(some, out=some)
        most = max(most, float((some[..., 0] + some[..., 1] + some[..., 2]).max()))
    return np.sqrt(most)


def numbers_texture(values, row_strands):
    """Return a texture with one number per strand, `row_strands` per row; values: (S,)."""
    numbers = np.zeros((-(-len(values) // row_strands), row_strands), np.float32)
    numbers.ravel()[: len(values)] = values
    return driver_textures.new_texture(numbers.shape[::-1], "R32F", numbers)


def pairs_texture(values, row_strands):
    """Return a texture with two numbers per strand, `row_strands` per row; values: (S, 2)."""
    pairs = np.zeros((-(-len(values) // row_strands), row_strands, 2), np.float32)
    pairs.reshape(-1, 2)[: len(values)] = values
    return driver_textures.new_texture(pairs.shape[1::-1], "RG32F", pairs)


def row_strands_of(point_count, others=0):
    """Whole strands per row of a texture of packed strands; others: extra texels before each strand."""
    return TEXTURE_WIDTH // (others + geometry.packed_strands.texel_count(point_count))


def packed_texture(points, row_strands):
    """Return a texture of packed (S, P, 3) points, `row_strands` whole strands per row, and their (2, 3) bounds."""
    strand_count, point_count, _xyz = points.shape
    texel_count, row_count = geometry.packed_strands.texel_count(point_count), -(-strand_count // row_strands)
    texels = np.empty((row_count * row_strands, texel_count, 2), np.float32)
    texels[strand_count:] = 0.0
    bounds = geometry.packed_strands.pack(points, texels[:strand_count])
    return _texture("RG32F", row_strands * texel_count, texels), bounds


_TEXEL_BYTES = {"RG32F": 8, "R32F": 4, "R16": 2, "RGBA16F": 8, "RGBA32F": 16}
_MOST_HALF = np.float32(60000.0)
_MOST_OF_R16 = 65535  # steps from 0 to 1
_SEEN_BYTES = 20  # per point in the visibility textures


def bytes_of(textures):
    """Memory of textures [bytes], each counted once."""
    by_id = {id(texture): texture for texture in textures}
    return sum(texture.width * texture.height * _TEXEL_BYTES[texture.format] for texture in by_id.values())


def seen_bytes(strands):
    """Memory of the visibility textures of `StrandsOnGPU` [bytes]."""
    return strands.texture.height * strands.row_strands * seen_points(strands.point_count) * _SEEN_BYTES


def with_radii(strands, radii):
    """`StrandsOnGPU` with other (S, P) float32 radii."""
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
    """Return (texture, number of strands, unit): (S, P) radii in two bytes each; a single strand if all are equal."""
    strand_count, point_count = radii.shape
    if (radii == radii[:1]).all():
        return _texture("R32F", point_count, np.ascontiguousarray(radii[:1], np.float32)), 1, 1.0
    greatest = float(radii.max())
    # Infinite radii stay infinite.
    texture_format, unit = ("R16", greatest) if np.isfinite(greatest) and greatest > 0.0 else ("R32F", 1.0)
    texels = np.zeros((-(-strand_count // row_strands) * row_strands, point_count), np.float32)
    np.divide(radii, unit, out=texels[:strand_count])
    if texture_format == "R16":
        _to_steps(texels)
    return _texture(texture_format, row_strands * point_count, texels), strand_count, unit


def _to_steps(numbers):
    """Adjust numbers in [0, 1], in place, so that every driver converts them to the nearest 16-bit numbers.

    Blender's Vulkan truncates and OpenGL rounds: a quarter of a step is added, which gives the same step in both.
    """
    numbers *= np.float32(_MOST_OF_R16)
    np.rint(numbers, out=numbers)
    numbers += np.float32(0.25)
    numbers /= np.float32(_MOST_OF_R16)
    np.minimum(numbers, np.float32(1.0), out=numbers)


def _texture(texture_format, width, texels):
    channels = 2 if texture_format == "RG32F" else 1
    return driver_textures.new_texture((width, texels.size // (channels * width)), texture_format, texels)


def like(texture):
    """Return an undefined texture of the same size for other strands."""
    return driver_textures.new_texture((texture.width, texture.height), "RG32F")


def seen_points(point_count):
    """Texels per strand in visibility textures: every SEEN_STEP points (shaders/strands/strip.glsl), and the tip."""
    return -(-(point_count - 1) // 4) + 1


def move_strands(strands, moved, points):
    """Move some of the strands on the GPU, upload only these, and return the new `StrandsOnGPU`.

    The arrays on the CPU are changed too. moved: (M,) distinct indices; points: (M, P, 3) float32. Bounds only grow
    until the next `upload_strands`.
    """
    strands.points[moved] = points
    texel_count, row_strands = (
        geometry.packed_strands.texel_count(strands.point_count),
        row_strands_of(strands.point_count, 1),
    )
    packed = np.empty((len(moved), texel_count, 2), np.float32)
    low, high = geometry.packed_strands.pack(points, packed)
    # Uploaded strands, which a stroke moves in each event, have a known box: only that of made strands has to be read.
    box = strands.box.exact if strands.box.known is None else strands.box.known
    np.minimum(box[0], low, out=box[0])
    np.maximum(box[1], high, out=box[1])
    texels = np.zeros((-(-len(moved) // row_strands) * row_strands, 1 + texel_count, 2), np.float32)
    texels[: len(moved), 0, 0] = moved  # exact in single precision up to 16 million
    texels[: len(moved), 1:] = packed
    texture = _texture("RG32F", row_strands * (1 + texel_count), texels)
    turn, rows = (strands.moved.turn, strands.moved.rows) if strands.moved else (0, _no_rows(strands))
    rows.clear(format="FLOAT", value=(0.0,))
    before = like(texture)
    copy_strands(strands, before, len(moved), row_strands, texture)
    program = _move_program()
    program.bind()
    program.uniform_sampler("moved_strands", texture)
    for name, image in (("strands", strands.texture), ("moved_rows", rows)):
        program.image(name, image)
    _dispatch(program, {"moved_count": len(moved), "moved_row_strands": row_strands}, strands, len(moved))
    return replace(strands, moved=Moved(before, row_strands, rows, turn + 1), lengthenings={}, is_made=False)


def copy_strands(strands, target, count, row_kept, listed=None):
    """Copy the texels of strands, preceded by one extra texel each, to a texture with `row_kept` strands per row.

    count: of strands; listed: a texture in this layout whose extra texels are indices of strands; None: all strands.
    """
    program = _keep_program()
    program.bind()
    program.uniform_sampler("strands", strands.texture)
    program.uniform_sampler("listed", strands.texture if listed is None else listed)
    program.image("kept_strands", target)
    numbers = {"kept_count": count, "row_kept": row_kept, "is_list": int(listed is not None)}
    _dispatch(program, numbers, strands, count)


def run_for_each(program, count, group_size):
    """Run a bound compute program for each of `count` strands, segments or texels, `group_size` in a work group.

    Work groups beyond `MOST_GROUPS` are dispatched in further rows along y; some of the last row may be idle.
    """
    groups = -(-count // group_size)
    rows = -(-groups // MOST_GROUPS)
    gpu.compute.dispatch(program, -(-groups // rows), rows, 1)


def _dispatch(program, numbers, strands, count):
    """Run a bound program on each texel of `count` strands."""
    texel_count = geometry.packed_strands.texel_count(strands.point_count)
    for name, value in (numbers | {"texel_count": texel_count, "row_strands": strands.row_strands}).items():
        program.uniform_int(name, value)
    run_for_each(program, count * texel_count, _MOVE_GROUP_SIZE)
    gpu.shader.unbind()


def _no_rows(strands):
    return numbers_texture(np.zeros(strands.strand_count), strands.row_strands)


@shaders.cached
def _move_program():
    """Return the compute program that writes the points of some strands into the texture of all."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_MOVE_GROUP_SIZE)
    info.sampler(0, "FLOAT_2D", "moved_strands")
    info.image(0, "RG32F", "FLOAT_2D", "strands", qualifiers={"WRITE"})
    info.image(1, "R32F", "FLOAT_2D", "moved_rows", qualifiers={"WRITE"})
    for name in ("moved_count", "moved_row_strands", "texel_count", "row_strands"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/write_strands.comp")


@shaders.cached
def _keep_program():
    """Return the compute program that copies strands. Metal cannot read from images of this format that it writes."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_MOVE_GROUP_SIZE)
    for slot, name in enumerate(("strands", "listed")):
        info.sampler(slot, "FLOAT_2D", name)
    info.image(0, "RG32F", "FLOAT_2D", "kept_strands", qualifiers={"WRITE"})
    for name in ("kept_count", "row_kept", "is_list", "texel_count", "row_strands"):
        info.push_constant("INT", name)
    return shaders.compile_compute(info, "strands/previous_strands.comp")


def vertex_count(strand_count, drawn_points):
    """Vertices of a strip through strands: two per point, and one repeated at either end to separate strands."""
    return strand_count * (2 * drawn_points + 2)


def bare_vertices(count, primitive="TRI_STRIP"):
    """Return a batch of vertices without attributes."""
    return gpu.types.GPUBatch(type=primitive, buf=gpu.types.GPUVertBuf(gpu.types.GPUVertFormat(), count))
