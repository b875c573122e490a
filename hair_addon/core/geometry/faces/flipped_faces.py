# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovery of the original faces after Blender has flipped them, as it does when it applies a mirroring scale.

A flipped face begins at the same corner and has the opposite winding. If modifiers subdivide faces, the faces of the
cage are flipped, which changes the order of each face's quads and of the vertices inside the face.
"""

from dataclasses import dataclass

import numpy as np

from ..mesh import Faces
from .cages import cage_starts, cage_vertices

_SIDES = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])


@dataclass(frozen=True)
class FlippedFaces:
    """The permutation of corners and vertices by a flip. The permutation is its own inverse.

    corners: (C,) int, the present corner of each original corner; vertices: (V,) int32, the present number of each
    original vertex, None if all numbers are unchanged.
    """

    corners: np.ndarray
    vertices: np.ndarray | None

    def before(self, corner_vertices: np.ndarray) -> np.ndarray:
        """Return the original vertices (C,) of corners, in the original numbering."""
        permuted = corner_vertices[self.corners]
        return permuted if self.vertices is None else self.vertices[permuted]


def turned(faces: Faces) -> FlippedFaces:
    """Return the `FlippedFaces` of faces without subdivision."""
    starts, sizes = faces.starts[:-1], np.diff(faces.starts)
    first, size = np.repeat(starts, sizes), np.repeat(sizes, sizes)
    corner = np.arange(len(first)) - first
    return FlippedFaces(first + (size - corner) % np.maximum(size, 1), None)


def turned_cage(faces: Faces, corner_count: int) -> FlippedFaces | None:
    """Return the `FlippedFaces` of faces whose cage was flipped; None if the quads of the cage's faces are unknown.

    corner_count: see `cage_vertices`.
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
        original = 4 * firsts[:, None] + np.arange(4 * count)
        present = 4 * firsts[:, None] + its_corners
        corners[original] = present
        vertices[faces.corner_vertices[original[:, is_inside]]] = faces.corner_vertices[present[:, is_inside]]
    return FlippedFaces(corners, vertices)


def _image(quads, cage_size):
    """Return the mirror image of a face's quads (Q, 4): ((4 Q,) int corners of the image, (4 Q,) bool: in the face).

    The image has the same first corner and the opposite winding; None if there is no such image.
    """
    numbers, flat = np.unique(quads, return_inverse=True)
    flat = flat.ravel()
    local = flat.reshape(quads.shape)
    own = [int(vertex) for vertex in flat[quads.ravel() < cage_size]]  # the corners of the face, in order
    if len(own) < 3 or len(set(own)) != len(own):
        return None
    sides = local[:, _SIDES].reshape(-1, 2)
    steps = _steps_from(own, np.concatenate([sides, sides[:, ::-1]]), len(numbers))
    # A vertex is identified by its distances to all corners of the face.
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
    """Return distances (V, N) int, in links (L, 2), from N origins to each of V vertices; `count` if unreachable."""
    steps = np.full((count, len(origins)), count)
    steps[origins, np.arange(len(origins))] = 0
    while True:
        before = steps.copy()
        np.minimum.at(steps, links[:, 1], before[links[:, 0]] + 1)
        if np.array_equal(steps, before):
            return steps
