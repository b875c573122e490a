# SPDX-License-Identifier: GPL-3.0-or-later
"""Clumps of hair on a sphere, and their cards."""

from types import SimpleNamespace

import numpy as np
import pytest

from hair_addon.core.cards import atlas, outlines, ribbons
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.search import clusters

COUNT, SEGMENTS, SIZE = 40, 6, 512


def sphere(radius=0.1, rings=16):
    """Return a `TriMesh` around the origin with outward faces."""
    lat, lon = np.linspace(0.02, np.pi - 0.02, rings), np.linspace(0.0, 2.0 * np.pi, 2 * rings, endpoint=False)
    grid = np.stack(
        [np.sin(lat)[:, None] * np.cos(lon), np.sin(lat)[:, None] * np.sin(lon), np.cos(lat)[:, None] + 0.0 * lon], -1
    )
    index = np.arange(rings * 2 * rings).reshape(rings, -1)
    here, right, below, across = index[:-1], np.roll(index, -1, 1)[:-1], index[1:], np.roll(index, -1, 1)[1:]
    triangles = np.concatenate([np.stack([here, below, right], -1), np.stack([right, below, across], -1)])
    return TriMesh(
        np.ascontiguousarray(radius * grid.reshape(-1, 3), np.float32),
        np.ascontiguousarray(triangles.reshape(-1, 3), np.int32),
    )


def wavy_hair(rng, count=1200, point_count=25):
    """Return (S, P, 3) float32 strands of several lengths that rise from a sphere, bend down and wave."""
    roots = rng.normal(size=(count, 3))
    roots[:, 2] = np.abs(roots[:, 2]) + 0.2
    outward = roots / np.linalg.norm(roots, axis=1, keepdims=True)
    s = np.linspace(0.0, 1.0, point_count)[None, :, None] * rng.uniform(0.1, 0.2, (count, 1, 1))
    points = 0.1 * outward[:, None] + s * outward[:, None] - np.array([0.0, 0.0, 4.0]) * s**2
    turn = np.cross(outward, [0.0, 0.0, 1.0])[:, None]
    return (points + 0.004 * np.sin(80.0 * s) * turn).astype(np.float32)


@pytest.fixture(scope="session")
def carded():
    """Return hair, its clumps, the ribbons' axes and outlines, flattened strands, atlas and mesh."""
    rng = np.random.default_rng(3)
    surface, points = sphere(), wavy_hair(rng)
    radii = np.full(points.shape[:2], 5e-4, np.float32)
    labels = clusters.clusters(clusters.strand_features(points), COUNT)
    axes = ribbons.axes_of(points, labels, COUNT, SEGMENTS, surface)
    flat = ribbons.flattened(points, labels, axes)
    found = outlines.outlines(flat, radii, labels, axes)
    places = atlas.atlas(found, np.bincount(labels), 0, SIZE)
    lifted = outlines.heights(flat, labels, found)
    mesh = outlines.ribbon_mesh(axes, found, places.uvs(found), lifted)
    return SimpleNamespace(
        surface=surface,
        points=points,
        radii=radii,
        labels=labels,
        axes=axes,
        flat=flat,
        outlines=found,
        atlas=places,
        lifted=lifted,
        mesh=mesh,
    )
