# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed meshes are oriented outwards, and rims are the edges with one triangle."""

import numpy as np
import pytest

from hair_addon.core.dynamics.collision.closed_parts import facing_hair, open_parts, outward, rims
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.meshes import flat_grid, subdivided_sphere


def volume(mesh, triangles):
    return np.linalg.det(mesh.vertices.astype(float)[triangles]).sum() / 6.0


def turned(mesh):
    return TriMesh(mesh.vertices, mesh.triangles[:, [0, 2, 1]])


def joined(*meshes):
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [mesh.triangles + np.int32(first) for mesh, first in zip(meshes, firsts[:-1], strict=True)]
    return TriMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


def moved(mesh, by):
    return TriMesh(mesh.vertices + np.asarray(by, np.float32), mesh.triangles)


def split(mesh):
    """Return the same triangles without shared vertices, as in some files."""
    return TriMesh(
        mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(mesh.triangles.size, dtype=np.int32).reshape(-1, 3)
    )


BALL = subdivided_sphere(2)


@pytest.mark.parametrize("mesh", [BALL, turned(BALL), split(turned(BALL)), moved(turned(BALL), (50.0, 0.0, 0.0))])
def test_closed_meshes_are_wound_outwards(mesh):
    assert volume(moved(mesh, -mesh.vertices.mean(axis=0)), outward(mesh)) > 4.0


@pytest.mark.parametrize("mesh", [flat_grid(3), turned(flat_grid(3)), TriMesh(BALL.vertices, BALL.triangles[5:, ::-1])])
def test_open_meshes_stay_as_they_are(mesh):
    np.testing.assert_array_equal(outward(mesh), mesh.triangles)


def test_each_closed_part_is_turned_by_itself_but_cavities_stay():
    small = TriMesh(0.5 * BALL.vertices, BALL.triangles)
    shell = joined(BALL, turned(small))
    np.testing.assert_array_equal(outward(shell), shell.triangles)
    beside = joined(BALL, moved(turned(small), (1.2, 0.0, 0.0)), flat_grid(2))
    wanted = joined(BALL, moved(small, (1.2, 0.0, 0.0)), flat_grid(2))
    np.testing.assert_array_equal(outward(beside), wanted.triangles)
    both = joined(turned(BALL), small)
    np.testing.assert_array_equal(outward(both), joined(BALL, small).triangles)


def test_rims_are_the_edges_with_one_triangle(head):
    assert not rims(BALL).any() and not rims(split(BALL)).any()
    for mesh in (flat_grid(4), split(flat_grid(4)), head):
        bits = rims(mesh)
        _, numbers = np.unique(mesh.vertices, axis=0, return_inverse=True)
        triangles = numbers.reshape(-1)[mesh.triangles]
        uses = {}
        for row in triangles:
            for k in range(3):
                edge = frozenset((row[(k + 1) % 3], row[(k + 2) % 3]))
                uses[edge] = uses.get(edge, 0) + 1
        on_rim = {vertex for edge, count in uses.items() if count == 1 for vertex in edge}
        for row, found in zip(triangles, bits, strict=True):
            edges = [uses[frozenset((row[(k + 1) % 3], row[(k + 2) % 3]))] == 1 for k in range(3)]
            assert found == sum(is_set << k for k, is_set in enumerate([*edges, *(v in on_rim for v in row)]))


def test_open_parts_are_turned_to_where_their_hair_is():
    """Each open part is turned by itself to the side of its hair; closed parts and parts without hair stay."""
    up, down = flat_grid(3), turned(moved(flat_grid(3), (0.0, 0.0, 1.0)))
    mesh = joined(up, down, moved(turned(flat_grid(2)), (0.0, 0.0, 2.0)), moved(BALL, (5.0, 0.0, 0.0)))
    parts = open_parts(mesh)
    sizes = [len(one.triangles) for one in (up, down, flat_grid(2), BALL)]
    assert [np.unique(part).size for part in np.split(parts, np.cumsum(sizes)[:-1])] == [1, 1, 1, 1]
    assert (parts < 0).sum() == sizes[3]
    firsts = np.cumsum([0, *sizes])
    corners = mesh.triangles[np.repeat(firsts[[0, 1, 3]], 3)]
    ways = np.tile([[0.1, 0.0, 1.0], [0.0, 0.2, 0.5], [0.3, 0.0, -0.1]], (3, 1))
    found = facing_hair(mesh, parts, corners, ways)
    is_other = (found != mesh.triangles).any(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(is_other), np.arange(firsts[1], firsts[2]))
    np.testing.assert_array_equal(found[is_other], mesh.triangles[is_other][:, [0, 2, 1]])
