# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of images at roots: the mean over each strand's share of the surface, so that fine patterns do not alias."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import warp as wp

from ..geometry.mesh import SurfacePoints, TriMesh
from ..kernels import kernel_cache, parallel
from ..kernels.checks import require_indices
from . import uv_islands

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_LEAST_STRANDS = 32_768  # fewer are not worth a thread
_TAPS = 4  # texels along each side that a strand's share touches at the level where its side is at most 3 texels


@dataclass(frozen=True, eq=False)
class _Taps:
    """Texels of some strands in an image and its halved versions, one after the other.

    strands: (N,) indices; texels: (N, K) int32; weights: (N, K) float32, in rows that sum to one.
    """

    strands: np.ndarray
    texels: np.ndarray
    weights: np.ndarray
    size: tuple[int, int]  # (width, height)

    @cached_property
    def limits(self) -> np.ndarray:
        """The smallest and the largest texel index."""
        return np.array([self.texels.min(initial=0), self.texels.max(initial=0)])

    @cached_property
    def boxes(self) -> tuple[np.ndarray, ...]:
        """First and last rows, and first and last columns (N,), of the image's texels in the share of each strand."""
        width, height = self.size
        shapes = [(height, width)]
        while max(height, width) > 1:
            height, width = (height + 1) // 2, (width + 1) // 2
            shapes.append((height, width))
        firsts = np.cumsum([0, *(height * width for height, width in shapes[:-1])], dtype=np.int32)
        level = np.searchsorted(firsts, self.texels[:, 0], side="right") - 1  # the same for all texels of a strand
        widths = np.array(shapes, np.int32)[level, 1]
        places = np.divmod(self.texels - firsts[level][:, None], widths[:, None])
        ends = ((side.min(axis=1) << level, (side.max(axis=1) + 1 << level) - 1) for side in places)
        return tuple(itertools.chain.from_iterable(ends))

    def touching(self, box: tuple[slice, slice]) -> np.ndarray:
        """Return the indices in `strands` of strands whose share may touch texels in a box from `changed_box`."""
        first_row, last_row, first_column, last_column = self.boxes
        rows, columns = box
        is_touched = (first_row < rows.stop) & (last_row >= rows.start)
        return np.flatnonzero(is_touched & (first_column < columns.stop) & (last_column >= columns.start))

    def __len__(self) -> int:
        return len(self.strands)

    def __getitem__(self, selection: np.ndarray) -> "_Taps":
        """Return the taps of some of the strands."""
        return _Taps(self.strands[selection], self.texels[selection], self.weights[selection], self.size)


@dataclass(frozen=True, eq=False)
class RootTexels:
    """Texels of images at roots; the texels depend on roots, UV map and sizes of images, not on pixels.

    tiles: {UDIM tile: `_Taps` of its strands}; the key is None for an image without tiles.
    """

    strand_count: int
    tiles: Mapping[int | None, _Taps]

    def sample(self, pixels: "Mapping[int | None, np.ndarray | Levels]") -> np.ndarray:
        """Return means (S, C) float32, NaN without a tile; pixels: {tile: (H, W, C) float32, bottom row first}."""
        levels = {tile: each if isinstance(each, Levels) else Levels(each) for tile, each in pixels.items()}
        channels = next(iter(levels.values())).pixels.shape[2] if levels else 1
        return self.resample(np.full((self.strand_count, channels), np.nan, np.float32), levels)

    def resample(self, before: np.ndarray, pixels: "Mapping[int | None, np.ndarray | Levels]") -> np.ndarray:
        """Return the means (S, C) where some tiles have changed; only strands on these tiles are sampled.

        before: (S, C) means before the change; pixels: of the changed tiles.
        """
        found = before.copy()
        for tile, each in pixels.items():
            taps = self.tiles.get(tile)
            if taps is not None:
                found[taps.strands] = _means(taps, each if isinstance(each, Levels) else Levels(each))
        return found

    def follow(self, before: np.ndarray, levels: "Levels", changed: tuple[slice, slice] | None) -> np.ndarray:
        """Return the means (S, C) of an image without tiles; only strands at changed texels are sampled.

        before: (S, C) means before the change; changed: the box of the change, from `changed_box`.
        """
        taps = self.tiles.get(None)
        if changed is None or taps is None:
            return before
        touched = taps.touching(changed)
        some = taps if 2 * len(touched) > len(taps) else taps[touched]
        found = before.copy()
        found[some.strands] = _means(some, levels)
        return found


class Levels:
    """The texels (N, C) of an image (H, W, C) and its halved versions, one after the other."""

    def __init__(self, pixels: np.ndarray) -> None:
        """Halve the image; its pixels must not change."""
        self.pixels = pixels
        levels = [np.ascontiguousarray(pixels, np.float32)]
        while max(levels[-1].shape[:2]) > 1:
            levels.append(halved(levels[-1]))
        self.texels = np.concatenate([level.reshape(-1, pixels.shape[2]) for level in levels])
        ends = np.cumsum([level.size // pixels.shape[2] for level in levels])
        parts = np.split(self.texels, ends[:-1])
        self._levels = [part.reshape(level.shape) for part, level in zip(parts, levels, strict=True)]
        self._for_kernels = [_for_kernels(level) for level in self._levels]

    def follow(self, pixels: np.ndarray, changed: tuple[slice, slice] | None) -> None:
        """Replace the image by one of the same shape, and halve only changed texels; changed: from `changed_box`."""
        self.pixels = pixels
        if changed is None:
            return
        rows, columns = changed
        self._levels[0][rows, columns] = pixels[rows, columns]
        for finer, level in itertools.pairwise(self._for_kernels):
            rows, columns = (slice(side.start // 2, (side.stop + 1) // 2) for side in (rows, columns))
            _halve_box(finer, level, rows, columns)


def halved(pixels: np.ndarray) -> np.ndarray:
    """Return the means of two by two texels of (H, W, C) float32; a last odd row or column stands alone."""
    height, width, channels = pixels.shape
    found = np.empty(((height + 1) // 2, (width + 1) // 2, channels), np.float32)
    _halve_box(_for_kernels(pixels), _for_kernels(found), slice(0, len(found)), slice(0, found.shape[1]))
    return found


def _for_kernels(pixels):
    return wp.array(pixels, dtype=float, ndim=3, device="cpu", copy=False)


def _halve_box(finer, found, rows, columns):
    """Write the means of two by two texels to some rows and columns of `found`."""
    inputs = [finer, rows.start, columns.start]
    size = rows.stop - rows.start, columns.stop - columns.start
    kernel_cache.launch(_halve, dim=size, inputs=inputs, outputs=[found], device="cpu")


@wp.kernel
def _halve(
    finer: wp.array3d[float],
    first_row: int,
    first_column: int,
    # outputs
    out_means: wp.array3d[float],
):
    row, column = wp.tid()
    row += first_row
    column += first_column
    below = wp.min(2 * row + 1, finer.shape[0] - 1)
    right = wp.min(2 * column + 1, finer.shape[1] - 1)
    for channel in range(finer.shape[2]):
        # Each texel is divided by four first, because sums of large floats overflow.
        left = 0.25 * finer[2 * row, 2 * column, channel] + 0.25 * finer[below, 2 * column, channel]
        out_means[row, column, channel] = left + (
            0.25 * finer[2 * row, right, channel] + 0.25 * finer[below, right, channel]
        )


def _means(taps, levels):
    size, texels = levels.pixels.shape[1::-1], levels.texels
    if size != tuple(taps.size):
        raise ValueError(f"pixels of size {size} at places for {taps.size}")
    require_indices("texels", taps.limits, len(texels))
    found = np.empty((len(taps.texels), texels.shape[1]), np.float32)
    kernel, kind = (_weigh_colors, wp.vec4) if texels.shape[1] == 4 else (_weigh, float)
    cells, weights = (
        wp.array(values, dtype=its_kind, ndim=2, device="cpu", copy=False)
        for values, its_kind in ((taps.texels, int), (taps.weights, float))
    )
    sources, means = (
        wp.array(values, dtype=kind, ndim=1 if kind is wp.vec4 else 2, device="cpu", copy=False)
        for values in (texels, found)
    )
    rows = [parallel.Rows(cells), parallel.Rows(weights)]
    options = {"device": "cpu", "least_rows": _LEAST_STRANDS}
    parallel.launch(kernel, len(found), inputs=[sources, *rows], outputs=[means], **options)
    return found


@wp.kernel
def _weigh(
    texels: wp.array2d[float],
    taps: wp.array2d[int],
    weights: wp.array2d[float],
    # outputs
    out_means: wp.array2d[float],
):
    root = wp.tid()
    for channel in range(texels.shape[1]):
        # Weights sum to one up to rounding: the mean of differences is exact for equal texels.
        first = texels[taps[root, 0], channel]
        total = float(0.0)
        for tap in range(1, taps.shape[1]):
            total += weights[root, tap] * (texels[taps[root, tap], channel] - first)
        out_means[root, channel] = first + total


@wp.kernel
def _weigh_colors(
    texels: wp.array[wp.vec4],
    taps: wp.array2d[int],
    weights: wp.array2d[float],
    # outputs
    out_means: wp.array[wp.vec4],
):
    """As `_weigh`, for four channels at once, in half of its time."""
    root = wp.tid()
    first = texels[taps[root, 0]]
    total = wp.vec4()
    for tap in range(1, taps.shape[1]):
        total += weights[root, tap] * (texels[taps[root, tap]] - first)
    out_means[root] = first + total


def root_texels(
    mesh: TriMesh,
    corner_uvs: np.ndarray,
    roots: SurfacePoints,
    sizes: Mapping[int | None, tuple[int, int]],
) -> RootTexels:
    """Return the `RootTexels` of roots (S,) on a mesh with a UV map (F, 3, 2).

    sizes: {UDIM tile: (width, height)}, or {None: ...} for an image that repeats. The share of a strand is a square
    around its root; its area is the mesh's area divided by the number of strands. Texels that another UV island touches
    do not take part.
    """
    require_indices("triangles", roots.triangle, len(corner_uvs))
    uvs = np.einsum("nc,ncu->nu", roots.barycentric.astype(np.float64), corner_uvs[roots.triangle].astype(np.float64))
    uvs = np.where(np.isfinite(uvs) & (np.abs(uvs) < 1e6), uvs, 0.0)
    side = _sides(mesh, corner_uvs, len(roots))[roots.triangle]
    islands_of = uv_islands.islands(corner_uvs, mesh.triangles)
    tiles = {}
    for tile, size in sizes.items():
        inside = np.arange(len(uvs)) if tile is None else np.flatnonzero(_tiles_of(uvs) == tile)
        if len(inside):
            covered = uv_islands.coverage(corner_uvs, islands_of, size, tile)
            texels, weights = _taps(
                np.mod(uvs[inside], 1.0), side[inside], covered.islands[roots.triangle[inside]], covered, tile is None
            )
            tiles[tile] = _Taps(inside, texels, weights, tuple(size))
    return RootTexels(len(uvs), tiles)


def _tiles_of(uvs):
    """Return UDIM tiles (N,); 0 outside all tiles."""
    column, row = np.floor(uvs).astype(np.int64).T
    return np.where((column >= 0) & (column < 10) & (row >= 0), 1001 + column + 10 * row, 0)


def _sides(mesh, corner_uvs, strand_count):
    """Return the side (F,) of a strand's share in each triangle, in units of the UV map."""
    edges = corner_uvs[:, 1:].astype(np.float64) - corner_uvs[:, :1]
    uv_areas = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    areas = mesh.areas
    share = areas.sum() / max(strand_count, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        side = np.sqrt(share * uv_areas / areas)
    return np.where(np.isfinite(side), side, 0.0)


def _taps(uvs, sides, islands_of, covered, repeats):
    """Return (texels (N, K), weights (N, K)) in the levels of one image; uvs (N, 2) within the image."""
    shapes = [low.shape for low in covered.lows]
    firsts = np.concatenate([[0], np.cumsum([height * width for height, width in shapes])])
    size = np.array(shapes[0][::-1])
    levels = np.ceil(np.log2(np.maximum(sides * size.max() / (_TAPS - 1), 1.0))).astype(int)
    levels = np.minimum(levels, len(shapes) - 1)
    count = len(uvs)
    texels, weights = np.zeros((count, _TAPS**2), np.int64), np.zeros((count, _TAPS**2))
    due = np.arange(count)
    while len(due):
        for level in np.unique(levels[due]):
            some = due[levels[due] == level]
            found = _on_level(uvs[some], sides[some], islands_of[some], covered, level, repeats)
            texels[some], weights[some] = firsts[level] + found[0], found[1]
        # Where other islands touch all texels of the share at this level, a finer level is tried.
        due = due[weights[due].sum(axis=1) <= 0.0]
        at_last = due[levels[due] == 0]
        own = np.minimum((uvs[at_last] * size).astype(np.int64), size - 1)
        texels[at_last], weights[at_last, 0] = (own[:, 1] * size[0] + own[:, 0])[:, None], 1.0
        due = due[levels[due] > 0]
        levels[due] -= 1
    weights /= weights.sum(axis=1, keepdims=True)
    heaviest = np.take_along_axis(texels, weights.argmax(axis=1)[:, None], axis=1)
    return np.where(weights > 0.0, texels, heaviest).astype(np.int32), weights.astype(np.float32)


def _on_level(uvs, sides, islands_of, covered, level, repeats):
    height, width = covered.lows[level].shape
    full = covered.lows[0].shape[::-1]
    columns, rows = (
        _along(uvs[:, axis] * full[axis] / 2**level, 0.5 * np.clip(sides * full[axis] / 2**level, 1.0, _TAPS - 1))
        for axis in (0, 1)
    )
    cells = []
    for (places, parts), count in ((columns, width), (rows, height)):
        is_inside = (places >= 0) & (places < count)
        cells.append((places % count, parts if repeats else parts * is_inside))
    texels = (cells[1][0][:, :, None] * width + cells[0][0][:, None, :]).reshape(len(uvs), -1)
    weights = (cells[1][1][:, :, None] * cells[0][1][:, None, :]).reshape(len(uvs), -1)
    return texels, weights * covered.is_of(level, texels, islands_of[:, None])


def _along(centre, half):
    """Return (texels (N, K), covered fractions (N, K)) of the interval from center - half to center + half."""
    texels = np.floor(centre - half).astype(np.int64)[:, None] + np.arange(_TAPS)
    ends = np.minimum((centre + half)[:, None], texels + 1), np.maximum((centre - half)[:, None], texels)
    return texels, np.maximum(ends[0] - ends[1], 0.0)
