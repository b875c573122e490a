# SPDX-License-Identifier: GPL-3.0-or-later
"""Evenness of sites on a surface, by samples and a k-d tree, independent of the placement code."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

HEXAGON_MOMENT = 5.0 / (18.0 * 3.0**0.5)
SAMPLES_PER_SITE = 300
CANDIDATES = 12


@dataclass(frozen=True)
class Evenness:
    """energy: relative to that of as many hexagons; variation: of the cells' areas; closest: least distance of two
    sites, relative to a honeycomb. A straight cell belongs to the nearest site in space, any other cell to the nearest
    site on the same island that faces the same way.
    """

    energy: float
    variation: float
    closest: float
    straight_energy: float
    straight_variation: float


def evenness(mesh, places):
    """Return the `Evenness` of places (n, 3) on a `TriMesh`."""
    points, weights, triangles = _samples(mesh, SAMPLES_PER_SITE * len(places))
    normals = mesh.scaled_normals / np.maximum(np.linalg.norm(mesh.scaled_normals, axis=1, keepdims=True), 1e-30)
    edges = np.concatenate([mesh.triangles[:, :2], mesh.triangles[:, 1:]])
    graph = coo_matrix((np.ones(len(edges)), edges.T), shape=(len(mesh.vertices),) * 2)
    islands = connected_components(graph)[1][mesh.triangles[:, 0]]
    site_triangles = triangles[cKDTree(points).query(places, workers=2)[1]]
    distances, sites = cKDTree(places).query(points, k=min(CANDIDATES, len(places)), workers=2)
    straight_energy, straight_variation = _moments(distances[:, 0], sites[:, 0], weights, len(places))
    is_same = islands[site_triangles][sites] == islands[triangles][:, None]
    is_same &= np.einsum("qki,qi->qk", normals[site_triangles][sites], normals[triangles]) > 0.0
    is_same[~is_same.any(axis=1), 0] = True
    first = is_same.argmax(axis=1)[:, None]
    distances = np.take_along_axis(distances, first, axis=1)[:, 0]
    sites = np.take_along_axis(sites, first, axis=1)[:, 0]
    gaps, others = cKDTree(places).query(places, k=min(CANDIDATES, len(places)))
    faces_same = np.einsum("nki,ni->nk", normals[site_triangles][others], normals[site_triangles]) > 0.0
    faces_same &= islands[site_triangles][others] == islands[site_triangles][:, None]
    closest = np.where(faces_same, gaps, np.inf)[:, 1:].min()
    spacing = np.sqrt(2.0 * weights.sum() / (len(places) * 3.0**0.5))
    return Evenness(
        *_moments(distances, sites, weights, len(places)), closest / spacing, straight_energy, straight_variation
    )


def _moments(distances, sites, weights, count):
    area = weights.sum()
    areas = np.bincount(sites, weights=weights, minlength=count)
    return weights @ distances**2 / (HEXAGON_MOMENT * area**2 / count), areas.std() / areas.mean()


def _samples(mesh, count):
    """Return the centers (Q, 3) of equal parts of each triangle, their areas (Q,) and triangles (Q,)."""
    sides = np.maximum(np.ceil(np.sqrt(mesh.areas * count / mesh.areas.sum())), 1).astype(int)
    sides[mesh.areas == 0.0] = 0
    points, areas, triangles = [], [], []
    for side in np.unique(sides[sides > 0]):
        chosen = np.flatnonzero(sides == side)
        i, j = np.indices((side, side)).reshape(2, -1)
        upright, upended = i + j < side, i + j < side - 1
        x = np.concatenate([i[upright] + 1 / 3, i[upended] + 2 / 3]) / side
        y = np.concatenate([j[upright] + 1 / 3, j[upended] + 2 / 3]) / side
        weights = np.stack([x, y, 1.0 - x - y], axis=1)
        points.append(np.einsum("bk,fkd->fbd", weights, mesh.corners[chosen]).reshape(-1, 3))
        areas.append(np.repeat(mesh.areas[chosen] / side**2, side**2))
        triangles.append(np.repeat(chosen, side**2))
    return np.concatenate(points), np.concatenate(areas), np.concatenate(triangles)
