# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of strands and of textured cards from several sides, in light from the viewer, for comparison."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import TriMesh
from .nearest_triangles import NONE, Samples
from .polygon_mesh import PolygonMesh

SAMPLES = 768  # along each side of a view
PIXELS = 128, 64, 32  # along each side of a view, for three distances
_MARGIN = 1.05  # size of a view, relative to the hair
_AMBIENT = 0.3  # part of the light that comes from all directions
_AT_ONCE = 400_000  # segments of strands in a batch
# Unit vectors to the right, upward and toward the viewer.
SIDES = np.array(
    [
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[-1, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [[0, -1, 0], [0, 0, 1], [-1, 0, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    ],
    float,
)


def side_toward(viewer: tuple[float, float, float]) -> np.ndarray:
    """Return the rows (3, 3) of a side: unit vectors to the right, upward and toward the viewer, who is not above."""
    toward = np.array(viewer) / np.linalg.norm(viewer)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


@dataclass(frozen=True)
class View:
    """A picture from one side: linear colors (n, n, 3) times coverage, and coverage (n, n), at the finest resolution.

    seen: (samples, samples) index of the strand, or of the quad of cards, in each sample, or `NONE`.
    """

    colors: np.ndarray
    coverage: np.ndarray
    seen: np.ndarray

    def pixels(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the colors and the coverage of `count`² pixels, each the mean of some of the finest pixels."""
        step = len(self.coverage) // count
        blocks = count, step, count, step
        return self.colors.reshape(*blocks, 3).mean(axis=(1, 3)), self.coverage.reshape(blocks).mean(axis=(1, 3))


class Sides:
    """The sides from which hair is seen, with a surface that hides hair behind it.

    points: (S, P, 3) of the hair, finite; surface: `TriMesh` in the same space; samples: along each side of a view;
    sides: (N, 3, 3) unit vectors to the right, upward and toward the viewer.
    """

    def __init__(self, points: np.ndarray, surface: TriMesh, samples: int = SAMPLES, sides: np.ndarray = SIDES) -> None:
        low, high = points.min(axis=(0, 1)).astype(float), points.max(axis=(0, 1)).astype(float)
        self._middle, self._width = 0.5 * (low + high), max(_MARGIN * float((high - low).max()), 1e-12)
        self._samples, self._sides = samples, sides
        self._surface = surface.vertices[surface.triangles]

    def of_strands(self, points: np.ndarray, radii: np.ndarray, colors: np.ndarray) -> Iterator[View]:
        """Yield the `View` of strands (S, P, 3) from each side; radii: (S, P); colors: (S, P, 3) linear."""
        pieces = points.shape[1] - 1
        for axes in self._sides:
            samples = Samples(self._samples)
            step = max(_AT_ONCE // pieces, 1)
            for first in range(0, len(points), step):
                rows = slice(first, first + step)
                samples.add(self._placed(strand_triangles(points[rows], radii[rows], axes[2]), axes))
            seen = self._hair_in(samples, axes, 2 * pieces * len(points))
            strand, piece = np.divmod(seen[seen >= 0] // 2, pieces)
            edges = points[strand, piece + 1].astype(float) - points[strand, piece]
            lengths = np.maximum(np.linalg.norm(edges, axis=1), 1e-12)
            # The normal that faces the viewer.
            facing = np.sqrt(np.clip(1.0 - (edges @ axes[2] / lengths) ** 2, 0.0, 1.0))
            shades = 0.5 * (colors[strand, piece] + colors[strand, piece + 1])
            yield _view(seen, shades, facing, 2 * pieces)

    def of_cards(self, mesh: PolygonMesh, maps: dict[str, np.ndarray]) -> Iterator[View]:
        """Yield the `View` of cards from each side; mesh: of quads; maps: textures of `TexelSums.maps`."""
        quads = mesh.faces.corner_vertices.reshape(-1, 4)
        corners = mesh.vertices[quads][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3).astype(float)
        uvs = mesh.uvs.reshape(-1, 4, 2)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 2)
        frames = _tangent_frames(corners, uvs)
        for axes in self._sides:
            samples = Samples(self._samples)
            placed = self._placed(corners, axes)
            samples.add(placed, uvs, maps["alpha"])
            seen = self._hair_in(samples, axes, len(corners))
            triangle, side = seen[seen >= 0], len(maps["alpha"])
            shares = _barycentric(placed[triangle], np.argwhere(seen >= 0)[:, ::-1] + 0.5)
            texels = np.clip((np.einsum("nc,nci->ni", shares, uvs[triangle]) * side).astype(int), 0, side - 1)
            column, row = texels.T
            normals = 2.0 * maps["normal"][row, column] - 1.0
            facing = np.abs(np.einsum("ni,nij,j->n", normals, frames[triangle], axes[2]))
            yield _view(seen, maps["color"][row, column], np.minimum(facing, 1.0), 2)

    def _placed(self, corners, axes):
        """Return corners (T, 3, 3) in samples and depths of a side."""
        placed = (corners - self._middle) @ axes.T / self._width
        placed[..., :2] = self._samples * (placed[..., :2] + 0.5)
        placed[..., 2] = 0.5 - 0.5 * placed[..., 2]  # leaves room for the surface behind and in front of the hair
        return placed

    def _hair_in(self, samples, axes, hair_count):
        """Return the visible triangle of hair in each sample, or `NONE`, after the surface is added."""
        samples.add(self._placed(self._surface, axes))
        seen = samples.triangles()
        return np.where(seen < hair_count, seen, NONE)


def strand_triangles(points: np.ndarray, radii: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Return triangles (2 · S · (P - 1), 3, 3), two for each segment of strands (S, P, 3), as wide as the strands.

    radii: (S, P); toward: (3,) unit vector to the viewer, which the triangles face.
    """
    edges = np.diff(points, axis=1)
    across = np.cross(toward, edges)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-12)
    first, second = points[:, :-1], points[:, 1:]
    here, there = radii[:, :-1, None] * across, radii[:, 1:, None] * across
    quads = np.stack([first - here, first + here, second + there, second - there], axis=2)
    return quads[:, :, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def _view(seen, colors, facing, per_item):
    """Return the `View` of samples: visible triangles (N, N), and colors (M, 3) and facing (M,) of those with hair.

    per_item: number of triangles of a strand, or of a quad.
    """
    count, per_side = PIXELS[0], len(seen) // PIXELS[0]
    row, column = np.nonzero(seen >= 0)
    pixel = (row // per_side) * count + column // per_side
    lit = (_AMBIENT + (1.0 - _AMBIENT) * facing) / per_side**2
    sums = [np.bincount(pixel, colors[:, channel] * lit, count**2) for channel in range(3)]
    coverage = np.bincount(pixel, minlength=count**2) / per_side**2
    items = np.where(seen >= 0, seen // per_item, NONE).astype(np.int32)
    return View(np.stack(sums, axis=-1).reshape(count, count, 3), coverage.reshape(count, count), items)


def _tangent_frames(corners, uvs):
    """Return frames (T, 3, 3) with rows along U, along V and along the normal of triangles (T, 3, 3)."""
    edges, steps = corners[:, 1:] - corners[:, :1], uvs[:, 1:].astype(float) - uvs[:, :1]
    area = _cross(steps[:, 0], steps[:, 1])
    area = np.where(np.abs(area) > 1e-18, area, 1e-18)[:, None]
    along_u = (steps[:, 1, 1, None] * edges[:, 0] - steps[:, 0, 1, None] * edges[:, 1]) / area
    along_v = (steps[:, 0, 0, None] * edges[:, 1] - steps[:, 1, 0, None] * edges[:, 0]) / area
    frames = np.stack([along_u, along_v, np.cross(edges[:, 0], edges[:, 1])], axis=1)
    return frames / np.maximum(np.linalg.norm(frames, axis=-1, keepdims=True), 1e-12)


def _barycentric(corners, places):
    """Return barycentric coordinates (N, 3) of places (N, 2) in triangles (N, 3, 3) seen from above."""
    a, b, c = (corners[:, corner, :2] for corner in range(3))
    of_a, of_b, area = _cross(c - b, places - b), _cross(a - c, places - c), _cross(b - a, c - a)
    shares = np.stack([of_a, of_b], axis=1) / np.where(area == 0.0, 1.0, area)[:, None]
    return np.concatenate([shares, 1.0 - shares.sum(axis=1, keepdims=True)], axis=1)


def _cross(one, other):
    """Return the signed areas (N,) between vectors (N, 2)."""
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
