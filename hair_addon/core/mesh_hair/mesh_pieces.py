# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected pieces of a hair mesh: cards, tubes and locks, with their boundary loops."""

from dataclasses import dataclass

import numpy as np

from ..errors import HairError
from ..geometry.faces.connected_components import joined
from ..geometry.mesh import TriMesh

MOST_TRIANGLES = 2_000_000  # of a hair mesh


@dataclass(frozen=True)
class Topology:
    """Connectivity of a piece with v vertices: triangles (f, 3), edges (e, 2), each once, and boundary loops.

    loops: [(n,) vertices in order], empty if is_simple is False: a boundary touches itself.
    """

    vertex_count: int
    triangles: np.ndarray
    edges: np.ndarray
    loops: list[np.ndarray]
    is_simple: bool

    @property
    def euler_characteristic(self) -> int:
        """Vertices - edges + faces: 1 for a card, 0 for an open tube, 2 for a closed lock."""
        return self.vertex_count - len(self.edges) + len(self.triangles)


@dataclass(frozen=True)
class Piece:
    """A connected piece: vertices (v,) and faces (f,) are indices in the mesh, in the order of its `Topology`.

    first_corners: (f, 3) bool; of the corners at a vertex, exactly one is true: it represents the vertex.
    """

    vertices: np.ndarray
    faces: np.ndarray
    topology: Topology
    first_corners: np.ndarray


def pieces_of(mesh: TriMesh) -> list[Piece]:
    """Return the pieces of a mesh; faces are connected if no other face shares their common edge.

    Vertices at the same position count as one; of faces with the same corners, such as both sides of a card, one is
    used. Raises `HairError`.
    """
    if not len(mesh.triangles):
        raise HairError("The hair mesh has no faces.")
    if len(mesh.triangles) > MOST_TRIANGLES:
        raise HairError(
            "The hair mesh has {count} triangles, more than {most}: use a part of it.",
            count=len(mesh.triangles),
            most=MOST_TRIANGLES,
        )
    if not np.isfinite(mesh.vertices).all():
        raise HairError("The hair mesh has non-finite coordinates: repair the mesh or its modifiers.")
    corners = _welded(mesh.vertices)[mesh.checked_triangles].astype(np.int64)
    used = _distinct_faces(corners)
    if not len(used):
        raise HairError("The hair mesh has no faces with an area.")
    corners = corners[used]
    labels = _labels(corners, len(mesh.vertices))
    order = np.argsort(labels, kind="stable")
    known: dict[bytes, Topology] = {}
    cuts = np.flatnonzero(np.diff(labels[order])) + 1
    return [_piece(corners[rows], used[rows], known) for rows in np.split(order, cuts)]


def _welded(vertices):
    """Return the first vertex (V,) at the position of each vertex."""
    # Adding zero turns -0 into 0. Rows are compared as bytes, which is faster than by columns.
    rows = np.ascontiguousarray(vertices.astype(np.float32) + np.float32(0.0)).view("V12").ravel()
    _, first, places = np.unique(rows, return_index=True, return_inverse=True)
    return first[places.ravel()]


def _distinct_faces(corners):
    """Return indices of the faces with three different corners; of equal faces, the first."""
    ordered = np.sort(corners, axis=1)
    is_face = (ordered[:, 0] < ordered[:, 1]) & (ordered[:, 1] < ordered[:, 2])
    faces = np.flatnonzero(is_face)
    order = faces[np.lexsort(ordered[faces].T)]
    is_first = np.ones(len(order), bool)
    is_first[1:] = (ordered[order[1:]] != ordered[order[:-1]]).any(axis=1)
    return np.sort(order[is_first])


def _edges_of(corners, vertex_count):
    """Return ((E, 2) edges, (3 F,) edge of each side of each face, (E,) number of their faces)."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = ends.min(axis=1).astype(np.int64) * vertex_count + ends.max(axis=1)
    found, places, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.stack([found // vertex_count, found % vertex_count], axis=1), places.ravel(), counts


def _labels(corners, vertex_count):
    """Return the piece (F,) of each face."""
    _, sides, counts = _edges_of(corners, vertex_count)
    order = np.argsort(sides, kind="stable")
    firsts = np.cumsum(counts) - counts
    shared = firsts[counts == 2]
    first, second = order[shared] // 3, order[shared + 1] // 3
    own = np.arange(len(corners))
    rows = np.concatenate([np.stack([own] * 3, axis=1), np.stack([first, second, second], axis=1)])
    return joined(rows, len(corners))[: len(corners)]


def _piece(corners, faces, known):
    vertices, first, places = np.unique(corners, return_index=True, return_inverse=True)
    triangles = places.reshape(-1, 3)
    key = triangles.tobytes()
    if key not in known:
        known[key] = _topology(triangles, len(vertices))
    first_corners = np.zeros(triangles.size, bool)
    first_corners[first] = True
    return Piece(vertices, faces, known[key], first_corners.reshape(-1, 3))


def _topology(triangles, vertex_count):
    edges, _, counts = _edges_of(triangles, vertex_count)
    loops = _loops(edges[counts == 1])
    return Topology(vertex_count, triangles, edges, loops or [], loops is not None)


def _loops(edges):
    """Return the closed loops of boundary edges (n, 2), or None if more than two meet at a vertex."""
    beside: dict[int, list[int]] = {}
    for first, second in edges.tolist():
        beside.setdefault(first, []).append(second)
        beside.setdefault(second, []).append(first)
    if any(len(ends) != 2 for ends in beside.values()):
        return None
    loops, left = [], set(beside)
    for start in beside:
        if start not in left:
            continue
        loop, before, here = [], -1, start
        while here in left:
            left.discard(here)
            loop.append(here)
            one, other = beside[here]
            before, here = here, (other if one == before else one)
        loops.append(np.array(loop))
    return loops
