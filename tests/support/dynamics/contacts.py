# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries of contact planes for points and strands, and colliders to query."""

import numpy as np
import warp as wp

from hair_addon.core.dynamics.collision.contact import PLANE, WIDTH, Contacts
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.meshes import flat_grid, subdivided_sphere

LANES = WIDTH
STEP = 1.0 / 192.0  # [s]
FAR = 10.0  # [m] from any collider


def lanes_of(strands, device):
    """Return lane groups of (S, N, 3) points of strands, S a multiple of LANES."""
    count = strands.shape[1]
    groups = strands.reshape(-1, LANES, 3 * count).transpose(0, 2, 1)
    return wp.array(np.ascontiguousarray(groups, np.float32), dtype=float, device=device)


def planes_of(found, vertex_count):
    """Return planes (S, N, 8) of the result of `find`, by strand."""
    return found.numpy().reshape(-1, vertex_count, PLANE, LANES).transpose(0, 3, 1, 2).reshape(-1, vertex_count, PLANE)


def strands_of(points):
    """Return strands with points (N, 3) as tips, with roots and other segments far away."""
    count = -(-len(points) // LANES) * LANES
    strands = np.full((count, 2, 3), FAR, np.float32)
    strands[: len(points), 1] = points
    return strands


class Asked:
    """Queries of contact planes at tips, without segments."""

    def __init__(self, colliders, count, groom=None):
        self.count, self.device = count, colliders.device
        groom = np.full((count, 3), FAR) if groom is None else groom
        self.contacts = Contacts(lanes_of(strands_of(groom), self.device), colliders)

    def __call__(self, points, last=None, **details):
        last = points if last is None else last
        there, before = (lanes_of(strands_of(np.float32(places)), self.device) for places in (points, last))
        found = planes_of(self.contacts.find(there, before, STEP, **details), 2)
        assert not found[:, 0].any()  # roots
        return found[: self.count, 1].astype(np.float64)


def gaps_of(planes, points):
    """Return the distances of points in front of their planes."""
    return np.einsum("ni,ni->n", planes[:, :3], points) - planes[:, 3]


def is_plane(planes):
    return np.linalg.norm(planes[:, :3], axis=1) > 0.5


def bumpy(rng, radius=0.1):
    """Return a closed mesh with ridges and hollows, around the origin."""
    ball = subdivided_sphere(2, radius)
    return TriMesh(ball.vertices * rng.uniform(0.8, 1.1, (len(ball.vertices), 1)).astype(np.float32), ball.triangles)


def around(rng, mesh, count, most=0.004):
    """Return points near a mesh, on both sides."""
    corners = mesh.corners[rng.integers(len(mesh.triangles), size=count)]
    weights = rng.dirichlet(np.ones(3), count)
    return np.einsum("nk,nki->ni", weights, corners) + rng.uniform(-most, most, (count, 3))


def sheet(rng):
    """Return a bumpy square of 0.2 m at z = 0."""
    grid = flat_grid(6, 0.2)
    vertices = grid.vertices - np.float32([0.1, 0.1, 0.0])
    vertices[:, 2] = rng.uniform(-0.004, 0.004, len(vertices))
    return TriMesh(vertices, grid.triangles)


def slab(rng):
    """Return a closed plate, 2 mm thick."""
    top = sheet(rng)
    count = len(top.vertices)
    below = top.vertices - np.float32([0.0, 0.0, 0.002])
    rim = np.flatnonzero(np.abs(top.vertices[:, :2]).max(axis=1) > 0.0999)
    rim = rim[np.argsort(np.arctan2(*top.vertices[rim, :2].T[::-1]))]
    after = np.roll(rim, -1)
    sides = np.concatenate([np.stack([rim, rim + count, after], 1), np.stack([after, rim + count, after + count], 1)])
    triangles = np.concatenate([top.triangles, top.triangles[:, ::-1] + count, sides])
    return TriMesh(np.concatenate([top.vertices, below]), triangles.astype(np.int32))


def groom_of(rng, mesh, count, segment):
    """Return strands around a mesh, partly inside, with segments of a given length."""
    roots = around(rng, mesh, count, 1e-4)
    steps = rng.normal(size=(count, 7, 3))
    steps *= segment / np.linalg.norm(steps, axis=2, keepdims=True)
    return np.concatenate([roots[:, None], roots[:, None] + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)
