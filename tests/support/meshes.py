# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as arrays: a file, a sphere, an octahedron, a square."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from hair_addon.core.geometry.mesh import TriMesh

HEAD = Path(__file__).resolve().parents[2] / "blend_samples" / "head.obj"


def read_obj(path):
    """Read a Wavefront file as a `TriMesh`, Z up; polygons become fans."""
    vertices, triangles = [], []
    for line in path.read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            x, y, z = map(float, words[:3])
            vertices.append((x, -z, y))
        elif kind == "f":
            corners = [int(word.split("/")[0]) - 1 for word in words]
            triangles += [(corners[0], second, third) for second, third in pairwise(corners[1:])]
    return TriMesh(np.array(vertices, np.float32), np.array(triangles, np.int32))


def subdivided_sphere(levels, radius=1.0):
    """Return an icosahedron whose triangles are split in four, `levels` times, and projected to a sphere."""
    golden = (1.0 + 5.0**0.5) / 2.0
    vertices = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    vertices = np.array(vertices + [(z, x, y) for x, y, z in vertices] + [(y, z, x) for x, y, z in vertices])
    # The 20 faces are the triples of neighbors, turned outwards.
    near = np.linalg.norm(vertices[:, None] - vertices[None], axis=-1) < 2.1
    triples = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[k, i]
    ]
    triangles = np.array([t if np.linalg.det(vertices[list(t)]) > 0 else t[::-1] for t in triples])
    for _ in range(levels):
        corners = vertices[triangles]
        middles = (corners + np.roll(corners, -1, axis=1)).reshape(-1, 3)
        unique, inverse = np.unique(middles.round(9), axis=0, return_inverse=True)
        m = inverse.reshape(-1, 3) + len(vertices)
        a, b, c = triangles.T
        parts = [(a, m[:, 0], m[:, 2]), (m[:, 0], b, m[:, 1]), (m[:, 2], m[:, 1], c), tuple(m.T)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        vertices = np.concatenate([vertices, unique])
    vertices = radius * vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return TriMesh(vertices.astype(np.float32), triangles.astype(np.int32))


def octahedron():
    """Return the octahedron with corners at a distance of one on the axes."""
    corners = np.float32([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]])
    faces = [(x, y, z)[:: 2 * ((x + y + z) % 2) - 1] for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    return TriMesh(corners, np.array(faces, np.int32))


def split_in_four(mesh):
    """Return the same surface with each triangle split into four."""
    middles = 0.5 * (mesh.corners + np.roll(mesh.corners, -1, axis=1))
    vertices = np.concatenate([mesh.vertices, middles.reshape(-1, 3)])
    vertices, numbers = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    numbers = numbers.reshape(-1)
    (a, b, c), (ab, bc, ca) = numbers[mesh.triangles].T, numbers[len(mesh.vertices) :].reshape(-1, 3).T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return TriMesh(vertices, np.concatenate([np.stack(part, axis=1) for part in parts]).astype(np.int32))


def flat_grid(side_count, size=1.0):
    """Return a square in the XY plane with normals up, of side_count² pairs of triangles."""
    x, y = np.meshgrid(*[np.linspace(0.0, size, side_count + 1)] * 2)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(side_count)[:, None] * (side_count + 1) + np.arange(side_count)).ravel()
    right, above = corner + 1, corner + side_count + 1
    triangles = np.concatenate([np.stack([corner, right, above], 1), np.stack([right, above + 1, above], 1)])
    return TriMesh(vertices.astype(np.float32), triangles.astype(np.int32))
