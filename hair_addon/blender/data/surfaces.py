# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that hair grows on, as arrays."""

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...core import dynamics, geometry
from ...core.geometry.mesh import Faces, TriMesh, check_mesh
from ...core.geometry.mirror import Mirror
from ...core.kernels.checks import require_indices

# Cached values that do not depend on posed vertices, and are copied to another pose.
_AT_REST = (
    "to_local_axes",
    "has_finite_rest",
    "local_mesh",
    "shape",
    "extent",
    "topology",
    "is_open",
    "turned",
    "turned_topology",
    "cage_vertices",
)

_RESIZED = 1.3  # a factor of size beyond the change by smoothing a cage

_MOST_TURNINGS = 8  # maximum number of cached turnings of a surface, for hair and guides on it


@dataclass(frozen=True)
class Surface:
    """A mesh object at rest: world axes and scale [m], with the object's origin at zero.

    Gravity is -Z, lengths are true, and an object far from the world's origin loses no precision. At rest means before
    shape keys and modifiers deform the mesh: hair is generated at rest, and deformed with the surface
    (surface_deform.py).
    """

    name: str
    mesh: TriMesh
    faces: Faces
    rest: np.ndarray  # (V, 3) float32, vertices at rest in local coordinates
    posed: np.ndarray  # (V, 3) float32, deformed vertices in local coordinates
    corner_uvs: np.ndarray | None  # (F, 3, 2) float32, None without a UV map
    uv_map: str
    to_world_axes: np.ndarray  # (3, 3) float64: local coordinates → this space
    is_mirrored: bool  # negative scale: triangles are wound opposite to Blender's
    cage_corners: int  # number of corners of the faces that modifiers subdivide smoothly, 0 for none
    smooth_rest: np.ndarray  # (V, 3) float32, vertices on the smooth surface at rest; `rest` itself without one
    undivided_corners: int  # number of corners of the faces that modifiers subdivide in any way, 0 for none
    # Whether Blender has flipped the faces since hair grew: triangles keep their former order.
    is_turned: bool = False
    is_cage: bool = False  # whether this is the cage of another surface
    # The `Surface` of the faces before subdivision, and (F,) one subdivided face for each of its faces.
    divided_of: "tuple[Surface, np.ndarray] | None" = None

    @cached_property
    def to_local_axes(self):
        """(3, 3) float64: this space → local coordinates."""
        return np.linalg.inv(self.to_world_axes)

    def to_local(self, points):
        """Return points (S, P, 3) of strands as float32 local coordinates."""
        return geometry.transform.transformed(points, self.to_local_axes)

    def from_local(self, positions):
        """Return local coordinates (..., 3) as float32 in this space."""
        return transformed(positions, self.to_world_axes)

    @cached_property
    def is_deformed(self):
        """Whether shape keys or modifiers deform the mesh."""
        return not geometry.fingerprint.are_equal(self.rest, self.posed)

    @cached_property
    def has_finite_rest(self):
        """Whether all vertices at rest are finite."""
        return bool(np.isfinite(self.rest).all())

    @cached_property
    def local_mesh(self):
        """The `TriMesh` at rest in local coordinates. Raises the `HairError` of `check_mesh`."""
        mesh = TriMesh(self.rest, self.mesh.triangles)
        check_mesh(mesh)
        return mesh

    @cached_property
    def posed_mesh(self):
        """The `TriMesh` deformed by modifiers and shape keys, as the artist sees it."""
        return TriMesh(self.from_local(self.posed), self.mesh.triangles) if self.is_deformed else self.mesh

    @property
    def drawn_on(self):
        """(V, 3) float32 vertices of the surface that lines are drawn on; None if they are those of `mesh`.

        None for a cage, whose lines `drawn_lines.at_rest` has moved to rest already.
        """
        return self.from_local(self.posed) if self.is_deformed and not self.is_cage else None

    @property
    def cage(self):
        """The `Surface` at rest before subdivision, exactly the same at every level. Hair grows on the cage.

        The surface itself if it is not subdivided, or its undivided faces are unknown.
        """
        return self if self.divided_of is None else self.divided_of[0]

    @cached_property
    def sized_cage(self):
        """The `cage`, scaled to the size of the posed surface if more than subdivision has changed the size."""
        if self.divided_of is None or not self.is_deformed:
            return self.cage
        smooth = (
            self.mesh if self.mesh.smooth_vertices is None else TriMesh(self.mesh.smooth_vertices, self.mesh.triangles)
        )
        with np.errstate(invalid="ignore", over="ignore"):
            areas = [float(mesh.areas.sum()) for mesh in (self.posed_mesh, smooth)]
        if not (np.isfinite(areas).all() and min(areas) > 0.0):
            return self.cage
        factor = np.float32(np.sqrt(areas[0] / areas[1]))
        return self.cage if 1.0 / _RESIZED < factor < _RESIZED else self.cage.posed_at(factor * self.cage.rest)

    def posed_at(self, posed, has_uvs=True):
        """Return a copy of the surface with its vertices at (V, 3) float32 local positions; has_uvs: keep its UVs."""
        other = replace(self, posed=posed) if has_uvs else replace(self, posed=posed, corner_uvs=None)
        known = {name: self.__dict__[name] for name in _AT_REST if name in self.__dict__}
        known["has_finite_rest"] = self.has_finite_rest  # which only poses need
        other.__dict__.update(known, _turnings=self._turnings, _nearest=self._nearest)  # shared by all poses
        return other

    @cached_property
    def _nearest(self):
        """{digest of points: result of `nearest_places`}."""
        return {}

    def nearest_places(self, points):
        """`places` nearest to (N, 3) float32 local points at rest, cached for all poses. Raises `HairError`."""
        key = hashlib.blake2b(points.tobytes(), digest_size=16).digest()
        if key not in self._nearest:
            while len(self._nearest) >= _MOST_TURNINGS:
                self._nearest.pop(next(iter(self._nearest)))
            # In local coordinates, like the nodes of follow_nodes.py, so that the object's scale does not matter.
            found = geometry.closest_point.SurfaceQuery(self.local_mesh).nearest(points)
            self._nearest[key] = self.places(found)
        return self._nearest[key]

    @cached_property
    def _turnings(self):
        """{bit mask of vertices: `VertexRotations`}."""
        return {}

    def turning(self, vertices):
        """Return the `VertexRotations` of vertices, indices in any shape, cached for all poses. Raises `HairError`."""
        require_indices("vertices", vertices, len(self.rest))
        is_chosen = np.zeros(len(self.rest), bool)
        is_chosen[vertices] = True
        key = np.packbits(is_chosen).tobytes()
        if key not in self._turnings:
            while len(self._turnings) >= _MOST_TURNINGS:
                self._turnings.pop(next(iter(self._turnings)))
            chosen = np.flatnonzero(is_chosen)
            self._turnings[key] = geometry.vertex_turns.turning(self.smooth_rest, self.faces, chosen)
        return self._turnings[key]

    def has_same_rest(self, other):
        """Whether strands generated on one surface also fit the other."""
        own, others = ((s.rest, s.mesh.triangles, s.to_world_axes) for s in (self, other))
        are_divided_alike = (self.cage_corners, self.undivided_corners) == (other.cage_corners, other.undivided_corners)
        return are_divided_alike and all(map(np.array_equal, own, others))

    def is_same_cage(self, other):
        """Whether another surface is the same surface at rest, at any level of subdivision."""
        return self.is_same_shape(other) and np.array_equal(self.to_world_axes, other.to_world_axes)

    def is_same_shape(self, other):
        """Whether another surface has the same cage at rest in local coordinates."""
        if cage_of(self.topology) != cage_of(other.topology) or self.cage_corners != other.cage_corners:
            return False
        return np.array_equal(self.of_cage(self.rest), other.of_cage(other.rest))

    def is_same(self, other):
        """Whether another surface equals this one, so that cached results are valid."""
        own, others = (
            (s.rest, s.posed, s.mesh.triangles, s.faces.corner_vertices, s.faces.starts, s.to_world_axes, s.corner_uvs)
            for s in (self, other)
        )
        named = [(s.name, s.uv_map, s.cage_corners, s.undivided_corners) for s in (self, other)]
        return named[0] == named[1] and all(map(np.array_equal, own, others))

    @property
    def mirror(self):
        """The `Mirror` along the object's local X axis."""
        normal = self.to_local_axes[0] / np.linalg.norm(self.to_local_axes[0])
        axis = self.to_world_axes[:, 0]
        return Mirror(normal, axis / (axis @ normal))

    @cached_property
    def shape(self):
        """The local `TriMesh` at rest if `mesh` is a rotated and uniformly scaled copy of it; else None.

        Roots are placed on it, so that rotation and scale of the object do not change them, not even by rounding, which
        relaxation would amplify.
        """
        if not _is_even(self.to_world_axes):
            return None
        # A mirrored object's triangles are wound the other way, like those of the rest shape mirrored at its origin.
        return TriMesh(-self.rest if self.is_mirrored else self.rest, self.mesh.triangles)

    def former_shape(self, rest, applied):
        """`shape`, or else the mesh, at the time strands were made; rest: (V, 3) rest positions then, None: as now.

        applied: `Affine` from the local coordinates of that time to the current ones.
        """
        if rest is None:
            return self.shape
        # Rounded to single precision like Blender's matrices, for exactly the same result.
        axes = (self.to_world_axes @ applied.axes).astype(np.float32).astype(np.float64)
        if not _is_even(axes):
            return TriMesh(transformed(rest, axes), self.mesh.triangles)
        return TriMesh(-rest if self.is_mirrored != applied.is_mirroring else rest, self.mesh.triangles)

    def root_vertices(self, points):
        """Return (N, 3) int32 vertices of the triangles of surface points, in Blender's order of corners."""
        vertices = self.mesh.triangles.take(points.triangle, axis=0)  # a third of the time of indexing
        return np.ascontiguousarray(vertices[:, [0, 2, 1]]) if self.is_mirrored else vertices

    def places(self, points):
        """Return (N, 3) int32 vertices and (N, 3) float32 barycentric coordinates of points, in Blender's order of
        corners.
        """
        return self.root_vertices(points), self.swap_winding(points).barycentric

    @property
    def has_flipped_winding(self):
        """Whether triangles are wound opposite to those that identify strands: Blender's, before any flip."""
        return self.is_mirrored != self.is_turned

    @property
    def scale(self):
        """The mean scale of the object: meters per unit of its local coordinates."""
        return abs(np.linalg.det(self.to_world_axes)) ** (1.0 / 3.0)

    @cached_property
    def extent(self):
        """The longest side of the bounding box at rest, in local coordinates."""
        return float(np.ptp(self.rest, axis=0).max())

    def of_cage(self, values):
        """Values of vertices → values of the cage's vertices, the same at every level of subdivision; None → None."""
        return values if values is None else values[: self.cage_size]

    @cached_property
    def is_open(self):
        """Whether the mesh has holes. Raises the `HairError` of `checked_triangles`."""
        return bool(dynamics.collision.closed_parts.rims(self.mesh).any())

    @cached_property
    def topology(self):
        """A digest of the faces by the vertices at their corners, independent of triangulation.

        The first half is of the faces before subdivision, and the same at every level.
        """
        return _half_key(self.cage_vertices) + _half_key(self.faces.corner_vertices, self.faces.starts)

    @cached_property
    def turned(self):
        """The `FlippedFaces` of the faces, or of the cage's faces, as Blender flips them."""
        count = self.undivided_corners
        found = geometry.faces.flipped_faces.turned_cage(self.faces, count) if count else None
        return geometry.faces.flipped_faces.turned(self.faces) if found is None else found

    @cached_property
    def turned_topology(self):
        """`topology` with each face flipped, as by Blender when it applies a mirroring scale."""
        faces = Faces(self.turned.before(self.faces.corner_vertices), self.faces.starts)
        of_cage = geometry.faces.cages.cage_vertices(faces, self.undivided_corners)
        return _half_key(of_cage) + _half_key(faces.corner_vertices, faces.starts)

    @cached_property
    def triangulated(self):
        """The `Faces` in the order of their triangles: the former order if the faces were flipped."""
        turned = self.turned
        if not self.is_turned or turned.vertices is None:
            return self.faces
        quads = self.faces.corner_vertices.reshape(-1, 4)[turned.corners[::4] // 4]
        return Faces(np.ascontiguousarray(quads).ravel(), self.faces.starts)

    @cached_property
    def cage_vertices(self):
        """(C,) int32: the vertices at the corners of faces before subdivision, face after face."""
        return geometry.faces.cages.cage_vertices(self.faces, self.undivided_corners)

    @property
    def cage_size(self):
        """The number of vertices of the cage, which come first; of all vertices without subdivision."""
        is_divided = self.cage_vertices is not self.faces.corner_vertices
        return int(self.cage_vertices.max()) + 1 if is_divided else len(self.rest)

    def points_at(self, polygons, vertices, barycentric):
        """Return (`SurfacePoints`, (N,) bool: whether invalid) of places, as from `places`, in `triangulated`
        polygons.
        """
        return geometry.faces.face_places.on_triangles(self.mesh, self.triangulated, polygons, vertices, barycentric)

    def to_local_normals(self, normals):
        """Transform unit normals (N, 3) to local coordinates, by the inverse transpose of `to_local`."""
        if np.array_equal(self.to_world_axes, np.eye(3)):
            return normals
        local = normals @ self.to_world_axes.astype(np.float32)
        return local / np.linalg.norm(local, axis=-1, keepdims=True)

    def identities(self, roots):
        """Return (S,) int32 identities and (S,) float32 random numbers in [0, 1), independent of the other strands."""
        return geometry.root_frames.identities(roots, self.has_flipped_winding)

    def uvs(self, points):
        """Return (N, 2) float32 UV coordinates of surface points; zeros without a UV map."""
        if self.corner_uvs is None:
            return np.zeros((len(points), 2), np.float32)
        of_corners = self.corner_uvs.take(points.triangle, axis=0)
        found = np.empty((len(points), 2), np.float32)
        for axis in range(2):  # a sixth of the time of a single sum over both axes
            first, second, third = (points.barycentric[:, c] * of_corners[:, c, axis] for c in range(3))
            found[:, axis] = first + second + third
        return found

    def swap_winding(self, points):
        """Convert barycentric coordinates of points to Blender's order of corners, or back."""
        return points.with_flipped_winding() if self.is_mirrored else points


def _is_even(axes):
    """Whether (3, 3) axes are a rotation, possibly mirrored, with uniform scale."""
    squares = axes.T @ axes
    return np.allclose(squares, np.eye(3) * np.trace(squares) / 3.0, rtol=0.0, atol=1e-5 * np.trace(squares))


_HALF = 16  # hexadecimal digits of each half of a topology


def cage_of(topology):
    """Return the half of a `Surface.topology` that subdivision does not change."""
    return topology[:_HALF]


def faces_of(topology):
    """Return the half of a `Surface.topology` of the faces that stored roots refer to."""
    return topology[_HALF:]


def _half_key(*arrays):
    key = hashlib.blake2b(digest_size=_HALF // 2)
    for array in arrays:
        key.update(np.ascontiguousarray(array, np.int32).tobytes())
    return key.hexdigest()


def transformed(positions, matrix):
    """Return (..., 3) float32 positions transformed by a (3, 3) matrix; the same array for the identity."""
    if np.array_equal(matrix, np.eye(3)):
        return np.asarray(positions, np.float32)
    return np.asarray(positions, np.float32) @ matrix.T.astype(np.float32)
