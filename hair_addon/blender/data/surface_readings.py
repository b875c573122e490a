# SPDX-License-Identifier: GPL-3.0-or-later
"""`Surface`s of data that was read from a mesh, and of its cage: the faces at rest before modifiers subdivide them.

The cage is exactly the same at every evaluated level of subdivision: it is triangulated here, and its UV coordinates
are those of the mesh before modifiers, as Blender smooths UV coordinates with the faces.
"""

from dataclasses import dataclass, replace

import bmesh
import numpy as np

from ...core import geometry
from ...core.geometry.mesh import Faces, TriMesh
from . import subdivided_surfaces
from .surfaces import Surface, transformed


@dataclass(frozen=True)
class Reading:
    """Inputs of a `Surface` except its pose; arrays as in `Surface`."""

    name: str
    rest: np.ndarray
    faces: Faces
    uv_map: str
    loop_uvs: np.ndarray | None  # (C, 2) float32
    to_world_axes: np.ndarray
    has_rest: bool  # whether Blender stores rest positions
    is_turned: bool
    is_divided: bool  # whether modifiers subdivide the mesh, at the current level or at another
    is_edited: bool = False  # whether it is divided and in Edit Mode, where the UV map before modifiers is not there

    def is_same(self, other):
        """Whether another reading results in the same `Surface`."""
        named = [
            (read.name, read.uv_map, read.has_rest, read.is_turned, read.is_divided, read.is_edited)
            for read in (self, other)
        ]
        if named[0] != named[1] or (self.loop_uvs is None) != (other.loop_uvs is None):
            return False
        own, others = (
            (
                r.rest,
                r.faces.corner_vertices,
                r.faces.starts,
                r.to_world_axes,
                np.float32(0) if r.loop_uvs is None else r.loop_uvs,
            )
            for r in (self, other)
        )
        return all(a is b or np.array_equal(a, b) for a, b in zip(own, others, strict=True))


def surface_of(read, posed, corners, cage_corners, undivided, own=None):
    """Return the `Surface` of a `Reading`; corners: (F, 3) of its triangles.

    own: (`Faces`, (C, 2) UV coordinates or None) of the mesh before its modifiers, if these may subdivide it.
    """
    cage = _cage_of(read, cage_corners, undivided, own) if read.is_divided else None
    return _surface(read, posed, corners, cage_corners, undivided, cage)


def _surface(read, posed, corners, cage_corners, undivided, cage):
    smooth_rest = subdivided_surfaces.smooth_positions(read.rest, read.faces, cage_corners)
    triangles = read.faces.corner_vertices[corners]
    corner_uvs = None if read.loop_uvs is None else read.loop_uvs[corners]
    is_mirrored = bool(np.linalg.det(read.to_world_axes) < 0.0)
    if is_mirrored:
        triangles = np.ascontiguousarray(triangles[:, [0, 2, 1]])
        corner_uvs = None if corner_uvs is None else corner_uvs[:, [0, 2, 1]]
    with np.errstate(invalid="ignore"):  # `check_mesh` rejects non-finite values
        smooth = None if smooth_rest is read.rest else transformed(smooth_rest, read.to_world_axes)
        mesh = TriMesh(transformed(read.rest, read.to_world_axes), triangles, smooth)
    return Surface(
        read.name,
        mesh,
        read.faces,
        read.rest,
        posed,
        corner_uvs,
        read.uv_map,
        read.to_world_axes,
        is_mirrored,
        cage_corners,
        smooth_rest,
        undivided,
        read.is_turned,
        divided_of=cage,
    )


def _cage_of(read, cage_corners, undivided, own):
    """Return (`Surface` of the cage, (F,) index of one subdivided face for each of its faces); None if unknown."""
    faces, first_faces = read.faces, np.arange(len(read.faces.starts) - 1)
    loop_uvs = read.loop_uvs
    own_faces, own_uvs = own or (None, None)
    if undivided:
        found = geometry.faces.cages.cage_faces(read.faces, undivided, own_faces)
        if found is None:
            return None
        faces, first_faces = found
        if loop_uvs is not None:
            is_own = own_uvs is not None and np.array_equal(own_faces.corner_vertices, faces.corner_vertices)
            is_of_cage = read.faces.corner_vertices <= faces.corner_vertices.max()
            loop_uvs = own_uvs if is_own else loop_uvs[is_of_cage]
    rest = read.rest[: int(faces.corner_vertices.max(initial=-1)) + 1] if undivided else read.rest
    corners = _triangle_corners(faces, rest)
    if read.is_turned:
        corners = turned_back(corners, faces, 0)
    at_rest = replace(read, faces=faces, rest=rest, loop_uvs=loop_uvs)
    corner_count = len(faces.corner_vertices) if cage_corners else 0
    return replace(_surface(at_rest, rest, corners, corner_count, 0, None), is_cage=True), first_faces


def _triangle_corners(faces, rest):
    """Return (T, 3) int32 corners of the triangulated faces of a cage."""
    corners, sizes = geometry.faces.cages.triangle_corners(faces, rest), np.diff(faces.starts)
    large = np.flatnonzero(sizes > 4)
    if not len(large):
        return corners
    cut, owners = bmesh.new(use_operators=False), geometry.faces.face_places.owners(faces)
    try:
        for face in large:
            places = rest[faces.corner_vertices[faces.starts[face] : faces.starts[face + 1]]]
            cut.faces.new([cut.verts.new(place) for place in places.tolist()])
        cut.verts.index_update()
        first = np.repeat(faces.starts[:-1][large] - np.cumsum(sizes[large]) + sizes[large], sizes[large] - 2)
        found = [[loop.vert.index for loop in triangle] for triangle in cut.calc_loop_triangles()]
    finally:
        cut.free()
    corners[np.isin(owners, large)] = np.array(found, np.int32) + first[:, None]
    return corners


def turned_back(corners, faces, undivided):
    """Return (T, 3) corners of triangles in their order before the faces, or those of the cage, were flipped."""
    turned = geometry.faces.flipped_faces.turned_cage(faces, undivided) if undivided else None
    if turned is None:
        return corners[_turned_order(faces)]
    quads = turned.corners.reshape(-1, 4)
    is_cut_otherwise = (corners[::2, 2] % 4 == 3)[quads[:, 0] // 4]  # Blender's other diagonal for non-convex quads
    cuts = np.where(is_cut_otherwise[:, None], (0, 3, 1, 1, 3, 2), (0, 2, 1, 0, 3, 2))
    return np.take_along_axis(quads, cuts, axis=1).reshape(-1, 3).astype(corners.dtype)


def _turned_order(faces):
    """Return (T,) int: the triangles of each face from last to first, which restores the order before a flip."""
    counts = np.diff(faces.starts) - 2
    firsts = np.repeat(np.cumsum(counts) - counts, counts)
    return 2 * firsts + np.repeat(counts, counts) - 1 - np.arange(len(firsts))
