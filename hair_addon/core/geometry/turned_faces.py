# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that Blender has turned, as it does where it applies a scale that mirrors: what they were before.

A turned face begins at the same corner and goes the other way around. Where modifiers subdivide faces, those of the
cage are turned: the quads that each is divided into, and the vertices inside it, come in another order then.
"""

from dataclasses import dataclass

import numpy as np

from .cages import cage_starts, cage_vertices
from .mesh import Faces

_SIDES = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])


@dataclass(frozen=True)
class TurnedFaces:
    """What corners and vertices were before a turn; to turn once more leads back.

    corners: (C,) int, the present corner that each was; vertices: (V,) int32, the present number of each, which was
    that of the vertex with its number now; None where all kept their numbers.
    """

    corners: np.ndarray
    vertices: np.ndarray | None

    def before(self, corner_vertices: np.ndarray) -> np.ndarray:
        """(C,) vertices of corners before, in the numbers of before."""
        there = corner_vertices[self.corners]
        return there if self.vertices is None else self.vertices[there]


def turned(faces: Faces) -> TurnedFaces:
    """The `TurnedFaces` of faces that nothing subdivides."""
    starts, sizes = faces.starts[:-1], np.diff(faces.starts)
    first, size = np.repeat(starts, sizes), np.repeat(sizes, sizes)
    corner = np.arange(len(first)) - first
    return TurnedFaces(first + (size - corner) % np.maximum(size, 1), None)


def turned_cage(faces: Faces, corner_count: int) -> TurnedFaces | None:
    """The `TurnedFaces` of faces whose cage was turned; None where it is not known which quads each face of it has.

    corner_count: as of `cage_vertices`.
    """
    starts = cage_starts(faces, corner_count)
    if starts is None:
        return None
    of_cage, quads = cage_vertices(faces, corner_count), faces.corner_vertices.reshape(-1, 4)
    cage_size = int(of_cage.max()) + 1
    counts = np.diff(starts)
    corners = np.arange(len(faces.corner_vertices))
    vertices = np.arange(int(quads.max()) + 1, dtype=np.int32)
    for count in np.unique(counts):
        firsts = starts[:-1][counts == count]
        image = _image(quads[firsts[0] : firsts[0] + count], cage_size)
        if image is None:
            return None
        its_corners, is_inside = image
        here = 4 * firsts[:, None] + np.arange(4 * count)
        there = 4 * firsts[:, None] + its_corners
        corners[here] = there
        vertices[faces.corner_vertices[here[:, is_inside]]] = faces.corner_vertices[there[:, is_inside]]
    return TurnedFaces(corners, vertices)


def _image(quads, cage_size):
    """((4 Q,) int: the corner of (Q, 4) quads of one face that each is in the face's image, (4 Q,) bool: inside it).

    The image has the face's first corner where it is, and goes the other way around; None where there is no such image.
    """
    numbers, flat = np.unique(quads, return_inverse=True)
    flat = flat.ravel()
    local = flat.reshape(quads.shape)
    own = [int(vertex) for vertex in flat[quads.ravel() < cage_size]]  # the corners of the face, in order
    if len(own) < 3 or len(set(own)) != len(own):
        return None
    sides = local[:, _SIDES].reshape(-1, 2)
    steps = _steps_from(own, np.concatenate([sides, sides[:, ::-1]]), len(numbers))
    # Steps to all corners of the face tell a vertex.
    known = {tuple(row): vertex for vertex, row in enumerate(steps.tolist())}
    images = steps[:, -np.arange(len(own)) % len(own)].tolist()
    if len(known) != len(numbers) or any(tuple(row) not in known for row in images):
        return None
    mirrored = np.array([known[tuple(row)] for row in images])
    of_corners = {
        (frozenset(quad), vertex): 4 * index + corner
        for index, quad in enumerate(local.tolist())
        for corner, vertex in enumerate(quad)
    }
    wanted = [(frozenset(quad), vertex) for quad in mirrored[local].tolist() for vertex in quad]
    if any(corner not in of_corners for corner in wanted):
        return None
    _pairs, which, uses = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    is_inside = np.ones(len(numbers), bool)
    is_inside[sides[uses[which.ravel()] == 1]] = False
    return np.array([of_corners[corner] for corner in wanted]), is_inside[flat]


def _steps_from(origins, links, count):
    """(V, N) int: how many links (L, 2) it takes from each of N vertices to each of V, count where there is no way."""
    steps = np.full((count, len(origins)), count)
    steps[origins, np.arange(len(origins))] = 0
    while True:
        before = steps.copy()
        np.minimum.at(steps, links[:, 1], before[links[:, 0]] + 1)
        if np.array_equal(steps, before):
            return steps
