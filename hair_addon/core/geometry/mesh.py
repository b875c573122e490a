# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes and points on their surface."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..errors import HairError
from ..kernels.checks import require_count, require_indices
from ..params import array_of

# Number of times that the bounding box is halved along each axis, to the cells by which triangles are sorted.
_HALVINGS = 10


@dataclass(frozen=True)
class SurfacePoints:
    """Points on a mesh: triangle (N,) int32 and barycentric (N, 3) float32, each row of which sums to one."""

    triangle: np.ndarray
    barycentric: np.ndarray

    def __len__(self) -> int:
        return len(self.triangle)

    def __getitem__(self, selection: slice | np.ndarray) -> "SurfacePoints":
        """Return the points of a slice, a mask or an index array."""
        return SurfacePoints(self.triangle[selection], self.barycentric[selection])

    def is_same(self, others: "SurfacePoints") -> bool:
        """Return whether the points are bit-identical to others."""
        return np.array_equal(self.triangle, others.triangle) and np.array_equal(self.barycentric, others.barycentric)

    def with_flipped_winding(self) -> "SurfacePoints":
        """Return the same points for triangles whose last two corners are swapped."""
        return SurfacePoints(self.triangle, np.ascontiguousarray(self.barycentric[:, [0, 2, 1]]))

    def joined(self, others: "SurfacePoints") -> "SurfacePoints":
        """Return these points followed by others."""
        return SurfacePoints(
            np.concatenate([self.triangle, others.triangle]), np.concatenate([self.barycentric, others.barycentric])
        )


@dataclass(frozen=True)
class TriMesh:
    """A mesh of vertices (V, 3) float32 [m] and triangles (F, 3) int32, wound counter-clockwise seen from outside.

    Degenerate triangles are kept, so that triangle indices are stable; no hair grows on them.
    Call `check_mesh` on meshes from outside.

    smooth_vertices: (V, 3) float32 [m] on the smooth surface of a subdivided mesh, used for normals; None for
    `vertices`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    smooth_vertices: np.ndarray | None = None

    @cached_property
    def checked_triangles(self) -> np.ndarray:
        """`triangles` with valid vertex indices, for kernels. Raises `HairError`."""
        _check_corners(self.triangles, len(self.vertices))
        return self.triangles

    @cached_property
    def corners(self) -> np.ndarray:
        """Positions (F, 3, 3) float64 [m] of the triangles' corners."""
        return self.vertices.astype(np.float64)[self.checked_triangles]

    @cached_property
    def scaled_normals(self) -> np.ndarray:
        """Normals (F, 3) float64 [m²] of the triangles, with twice the area as length."""
        first, second, third = np.moveaxis(self.corners, 1, 0)
        return np.cross(second - first, third - first)

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas (F,) float64 [m²]; exactly zero for triangles that are degenerate in single precision."""
        areas = 0.5 * np.linalg.norm(self.scaled_normals, axis=1)
        first, second, third = np.moveaxis(self.corners, 1, 0)
        edges = np.stack([second - first, third - second, first - third])
        longest = np.einsum("efi,efi->ef", edges, edges).max(axis=0)
        # The normal of a sliver thinner than the rounding of its coordinates is unreliable.
        return np.where(areas > 1e-9 * longest, areas, 0.0)

    @cached_property
    def vertex_normals(self) -> np.ndarray:
        """Unit normals (V, 3) float32: means of the faces' normals weighted by their angles [Thurmer98].

        Zero where no face of positive area meets, or where normals cancel.
        """
        if self.smooth_vertices is not None:
            return TriMesh(self.smooth_vertices, self.triangles).vertex_normals
        corners, face_normals = self.corners, _unit(self.scaled_normals)
        normals = np.zeros(self.vertices.shape)
        face_normals[self.areas == 0.0] = 0.0
        for corner in range(3):
            towards_next = _unit(corners[:, (corner + 1) % 3] - corners[:, corner])
            towards_last = _unit(corners[:, (corner + 2) % 3] - corners[:, corner])
            angles = np.arccos(np.clip(np.einsum("fi,fi->f", towards_next, towards_last), -1.0, 1.0))
            for axis in range(3):
                normals[:, axis] += np.bincount(
                    self.triangles[:, corner], weights=angles * face_normals[:, axis], minlength=len(normals)
                )
        return _unit(normals).astype(np.float32)

    @cached_property
    def surface_order(self) -> np.ndarray:
        """Indices (F,) of triangles along a Z-curve [Morton66]: neighbors on the surface are near in memory."""
        centres = self.corners.mean(axis=1)
        extent = max(float(np.ptp(centres, axis=0).max()), 1e-30)
        cells = ((centres - centres.min(axis=0)) * ((2**_HALVINGS - 1) / extent)).astype(np.uint32)
        for shift, kept in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
            cells = (cells | cells << shift) & kept  # two zeros behind every bit
        return np.argsort(cells @ np.array([1, 2, 4], np.uint32), kind="stable")


@dataclass(frozen=True)
class Faces:
    """Polygons of a mesh: corner_vertices (C,) int32, concatenated, and starts (F+1,) int32 of each polygon."""

    corner_vertices: np.ndarray
    starts: np.ndarray

    def around(self, vertex_count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return starts (V+1,) int32 and (C,) int32: the faces around each vertex, in the order of their corners.

        vertex_count: of the mesh. Raises `HairError` for invalid polygons.
        """
        ends, faces = self._around
        require_indices("vertices", self.corner_vertices, vertex_count)
        return np.append(ends, np.full(vertex_count + 1 - len(ends), len(faces), np.int32)), faces

    @cached_property
    def _around(self):
        sizes = np.diff(self.starts)
        if len(self.starts) == 0 or self.starts[0] != 0 or (sizes < 3).any():
            raise HairError("Each polygon of a mesh needs three corners or more.")
        require_count("corners of polygons", len(self.corner_vertices), int(self.starts[-1]))
        require_indices("vertices", self.corner_vertices, np.iinfo(np.int32).max)  # none is negative
        order = np.argsort(self.corner_vertices, kind="stable")
        faces = np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)[order]
        return np.append(0, np.cumsum(np.bincount(self.corner_vertices))).astype(np.int32), faces


def from_arrays(vertices: ArrayLike, triangles: ArrayLike) -> TriMesh:
    """Return a `TriMesh` of vertices (V, 3) [m] and triangles (F, 3), arrays or nested lists of any numeric type.

    Raises `HairError`, also for indices that a cast would wrap or truncate.
    """
    vertices, triangles = _numbers(vertices, "vertices"), _numbers(triangles, "triangles")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise HairError(f"A mesh is vertices (V, 3) and triangles (F, 3), not {vertices.shape} and {triangles.shape}.")
    if triangles.dtype.kind == "f" and not (np.isfinite(triangles) & (triangles == np.floor(triangles))).all():
        raise HairError("The triangles of a mesh must be whole numbers: indices of its vertices.")
    _check_corners(triangles, len(vertices))
    with np.errstate(over="ignore"):  # values beyond single precision become infinite, which `check_mesh` rejects
        return TriMesh(np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32))


def _numbers(given, name):
    array = array_of(given)
    if array is None:
        raise HairError(f"The {name} of a mesh must be an array of numbers.")
    if array.dtype.kind not in "iuf":
        raise HairError(f"The {name} of a mesh must be numbers, not values of type {array.dtype}.")
    return array


def _check_corners(triangles, vertex_count):
    """Raise `HairError` unless every corner of triangles, of any integral type, is a vertex."""
    if not len(triangles):
        return
    lowest, highest = int(triangles.min()), int(triangles.max())
    if lowest < 0 or highest >= vertex_count:
        outside = lowest if lowest < 0 else highest
        raise HairError(
            f"A face of the surface uses vertex {outside}, but the mesh has {vertex_count}: validate the mesh."
        )


def check_mesh(mesh: TriMesh) -> None:
    """Raise `HairError` unless hair can grow on the mesh: faces, valid indices, finite vertices, positive area."""
    if len(mesh.triangles) == 0:
        raise HairError("The surface has no faces to grow hair on.")
    _ = mesh.checked_triangles
    bad_count = int(np.count_nonzero(~np.isfinite(mesh.vertices).all(axis=1)))
    if bad_count:
        raise HairError(
            "{count} of the surface's {all} vertices have non-finite coordinates: "
            "repair the mesh or the modifier that makes them.",
            count=bad_count,
            all=len(mesh.vertices),
        )
    largest = float(np.abs(mesh.vertices).max())
    if largest > 1e15:  # squares of single-precision lengths must stay finite
        sentence = "The surface extends {distance:g} m from the origin: check the object's scale."
        raise HairError(sentence, distance=largest)
    if not np.any(mesh.areas > 0.0):
        raise HairError("Every face of the surface has zero area: check the object's shape and scale.")


def require_finite(vertices: np.ndarray) -> None:
    """Raise `HairError` unless vertices (V, 3) are finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        total = vertices.sum()  # finite only if all of them are: a third of the time
    if not np.isfinite(total) and not np.isfinite(vertices).all():
        raise HairError("Some of the surface's vertices have non-finite coordinates: repair the mesh or its modifiers.")


def check_points(mesh: TriMesh, points: SurfacePoints) -> None:
    """Raise `HairError` unless the points are on the mesh; points from a file may belong to another one."""
    triangle, barycentric = points.triangle, points.barycentric
    if len(points) == 0:
        raise HairError("There are no guides: generate guides first.")
    on_mesh = (triangle >= 0) & (triangle < len(mesh.triangles)) & np.isfinite(barycentric).all(axis=1)
    if not on_mesh.all():
        sentence = "{count} guides are rooted on missing faces: regenerate the guides."
        raise HairError(sentence, count=np.count_nonzero(~on_mesh))


def interpolate(values: np.ndarray, mesh: TriMesh, points: SurfacePoints) -> np.ndarray:
    """Return values (V,) or (V, K) of vertices, interpolated linearly to points: (N,) or (N, K) float32."""
    values = np.asarray(values, dtype=np.float32)
    total = np.zeros((), np.float32)
    # `take` is three times as fast as indexing with brackets.
    for corner, vertices in enumerate(mesh.triangles.take(points.triangle, axis=0).T):
        part = values.take(vertices, axis=0)
        part *= points.barycentric[:, corner].reshape((-1,) + (1,) * (values.ndim - 1))
        part += total
        total = part
    return total


def positions(mesh: TriMesh, points: SurfacePoints) -> np.ndarray:
    """Return the positions (N, 3) float32 [m] of points."""
    return interpolate(mesh.vertices, mesh, points)


def normals(mesh: TriMesh, points: SurfacePoints) -> np.ndarray:
    """Return smooth unit normals (N, 3) float32; the triangle's normal where the smooth one vanishes."""
    smooth = interpolate(mesh.vertex_normals, mesh, points)
    lengths = np.linalg.norm(smooth, axis=1, keepdims=True)
    vanishing = np.flatnonzero(lengths < 1e-6)
    smooth[vanishing] = _unit(mesh.scaled_normals[points.triangle[vanishing]])
    lengths[vanishing] = 1.0
    return smooth / lengths


def _unit(vectors):
    """Return normalized vectors (N, 3); zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, 1.0)
