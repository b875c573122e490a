# SPDX-License-Identifier: GPL-3.0-or-later
"""Mean curvature of a triangle mesh, from the angles at its edges  [CohenSteiner03]."""

import numpy as np

from .mesh import TriMesh

SHARPEST = 10.0  # limit of the curvature, relative to a sphere of the same area


def mean_curvature(mesh: TriMesh) -> np.ndarray:
    """Return the absolute mean curvature (V,) float64 [1/m], half the sum of principal curvatures; 1 / r on a sphere.

    The integral of mean curvature over a patch is the sum of a quarter of each edge's length times its dihedral angle,
    with half of the edge in each face [CohenSteiner03]. An edge with one face, or more than two, has no curvature.
    """
    triangles = np.flatnonzero(mesh.areas > 0.0)
    corners = mesh.triangles[triangles]
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    vertex_count = len(mesh.vertices)
    keys = np.minimum(starts, ends).astype(np.int64) * vertex_count + np.maximum(starts, ends)
    order = np.argsort(keys, kind="stable")
    _, firsts, counts = np.unique(keys[order], return_index=True, return_counts=True)
    firsts = firsts[counts == 2]
    one, other = order[firsts], order[firsts + 1]
    normals = mesh.scaled_normals[triangles] / (2.0 * mesh.areas[triangles, None])
    # Faces with opposite winding traverse a shared edge in the same direction: one normal is flipped.
    senses = np.where(starts[one] == starts[other], -1.0, 1.0)[:, None]
    first_normals, second_normals = normals[one // 3], senses * normals[other // 3]
    edges = (mesh.vertices[ends[one]] - mesh.vertices[starts[one]]).astype(np.float64)
    lengths = np.linalg.norm(edges, axis=1)
    sines = np.einsum("ei,ei->e", np.cross(first_normals, second_normals), edges) / np.where(
        lengths > 0.0, lengths, 1.0
    )
    cosines = np.einsum("ei,ei->e", first_normals, second_normals)
    bends = 0.25 * lengths * np.arctan2(sines, cosines)
    integrals, areas = np.zeros(vertex_count), np.zeros(vertex_count)
    for vertices in (starts[one], ends[one]):
        integrals += np.bincount(vertices, weights=bends, minlength=vertex_count)
    for vertices in corners.T:
        areas += np.bincount(vertices, weights=mesh.areas[triangles] / 3.0, minlength=vertex_count)
    # Sums include the neighbors, because the value at a single vertex depends on the shapes of its triangles.
    integrals, areas = (_over_neighbours(sums, corners) for sums in (integrals, areas))
    return np.abs(integrals) / np.where(areas > 0.0, areas, 1.0)


def _over_neighbours(sums, corners):
    """Return sums (V,) over the corners of each vertex's triangles (F, 3)."""
    of_triangles = sums[corners].sum(axis=1)
    return sum(np.bincount(vertices, weights=of_triangles, minlength=len(sums)) for vertices in corners.T)


def bend_density(mesh: TriMesh, strength: float) -> np.ndarray:
    """Return a density (V,) float64: 1 where flat, 1 + strength at the curvature of a sphere with the same area."""
    sphere_radius = np.sqrt(mesh.areas.sum() / (4.0 * np.pi))
    return 1.0 + strength * np.minimum(sphere_radius * mean_curvature(mesh), SHARPEST)
