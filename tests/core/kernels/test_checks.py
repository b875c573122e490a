# SPDX-License-Identifier: GPL-3.0-or-later
"""Every public function that launches a kernel refuses counts and indices that do not match, before it launches."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import root_frames, strands, surface_deform, transform
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.faces.connected_components import connected_components
from hair_addon.core.geometry.mesh import Faces, SurfacePoints, TriMesh
from hair_addon.core.geometry.search import hash_grid
from hair_addon.core.grooming import following, groom
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.interpolation import clump_centers, guide_weights, interpolation
from hair_addon.core.kernels import parallel
from hair_addon.core.kernels.checks import require_indices
from tests.support.devices import DEVICE

# The corners of a unit square, which two triangles share.
VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
SQUARE = TriMesh(VERTICES, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
TORN = TriMesh(VERTICES, np.array([[0, 1, 2], [0, 2, 4]], np.int32))


def vectors(*shape):
    return wp.zeros(shape, dtype=wp.vec3, device=DEVICE)


@pytest.fixture(scope="module")
def groomed():
    """Return (guides, binding) on the square."""
    guides = groom.distribute_guides(SQUARE, GuideSettings(guide_count=12, length=0.2), device=DEVICE)
    return guides, groom.bind_hair(SQUARE, guides, HairSettings(strand_count=50), device=DEVICE)


def motion():
    return surface_deform.motion(VERTICES, 2.0 * VERTICES, Faces(np.array([0, 1, 2, 3], np.int32), np.array([0, 4])))


def weights_of(groomed):
    return groomed[1].guide_weights


def carry(count=3, places=3, highest=2):
    vertices = np.full((places, 3), highest, np.int32)
    return surface_deform.carry(np.zeros((count, 5, 3), np.float32), motion(), vertices, np.ones((places, 3)))


def interpolate(groomed, roots=50, normals=50, guides=12, **changes):
    weights = replace(weights_of(groomed), **changes)
    return interpolation.interpolate(vectors(roots), vectors(normals), vectors(guides, 41), vectors(guides), weights)


MISMATCHES = {
    "fewer roots than strands": lambda _: carry(places=2),
    "more roots than strands": lambda _: carry(places=4),
    "a root on a vertex that is not there": lambda _: carry(highest=4),
    "a root on a negative vertex": lambda _: carry(highest=-1),
    "interpolation: roots and weights": lambda g: interpolate(g, roots=60, normals=60),
    "interpolation: normals": lambda g: interpolate(g, normals=49),
    "interpolation: fewer guides than were found": lambda g: interpolate(g, guides=11),
    "interpolation: weights of some": lambda g: interpolate(g, weights=weights_of(g).weights[:40]),
    "limits: fewer guides than were found": lambda g: guide_weights.limited(
        weights_of(g), vectors(11, 41), vectors(11), guide_weights.Limits()
    ),
    "weights: fewer guides than were found": lambda g: guide_weights.weigh(
        g[1].candidates, g[1].normals, vectors(11), None, 8
    ),
    "weights: fewer strands": lambda g: guide_weights.weigh(g[1].candidates, vectors(49), g[1].guide_normals, None, 8),
    "candidates: normals": lambda _: guide_weights.find_candidates(vectors(9), vectors(8), vectors(3), vectors(3), 2),
    "regions": lambda _: guide_weights.find_candidates(
        vectors(9), vectors(9), vectors(3), vectors(3), 2, regions=(np.zeros(8, np.int32), np.zeros(3, np.int32))
    ),
    "following: a strand that is not there": lambda g: following.follow_some(g[1], g[0], np.array([50])),
    "following: other guides": lambda g: following.weights_now(g[1], replace_guides(g[0])),
    "growing into another array": lambda g: following.growing_points(
        g[1], g[0], weights_of(g), out=np.zeros((49, 41, 3), np.float32)
    ),
    "leaders: a guide that is not there": lambda _: clump_centers.clump_centers(
        [0, 3], np.zeros((2, 3)), np.zeros((3, 3))
    ),
    "leaders: strands": lambda _: clump_centers.clump_centers([0, 2], np.zeros((1, 3)), np.zeros((3, 3))),
    "roots: a triangle that is not there": lambda _: root_frames.rooted(
        SQUARE, SurfacePoints(np.array([2], np.int32), np.ones((1, 3), np.float32)), DEVICE
    ),
    "roots: coordinates": lambda _: root_frames.rooted(
        SQUARE, SurfacePoints(np.zeros(2, np.int32), np.ones((1, 3), np.float32)), DEVICE
    ),
    "roots: a torn mesh": lambda _: root_frames.rooted(
        TORN, SurfacePoints(np.zeros(1, np.int32), np.ones((1, 3), np.float32)), DEVICE
    ),
    "islands: a torn mesh": lambda _: connected_components(TORN),
    "queries: a torn mesh": lambda _: SurfaceQuery(TORN, device=DEVICE),
    "queries: no area": lambda _: SurfaceQuery(TriMesh(0.0 * VERTICES, SQUARE.triangles), device=DEVICE),
    "queries: not a number": lambda _: SurfaceQuery(SQUARE, device=DEVICE).nearest(np.full((1, 3), np.nan)),
    "queries: distances": lambda _: SurfaceQuery(SQUARE, device=DEVICE).nearest(VERTICES, np.ones(3)),
    "the grid: not a number": lambda _: hash_grid.neighbours(
        wp.array([[np.nan, 0, 0]], dtype=wp.vec3, device=DEVICE), vectors(1), 1.0, 1
    ),
    "rows": lambda _: parallel.launch(
        transform._transform, 5, [parallel.Rows(vectors(5, 2)), wp.mat33()], [vectors(4, 2)], DEVICE
    ),
    "transform": lambda _: transform.transformed(
        np.zeros((5, 2, 3), np.float32), 2.0 * np.eye(3), np.zeros((4, 2, 3), np.float32)
    ),
}


def replace_guides(guides):
    return strands.from_numpy(guides.numpy()[:11], guides.roots[:11], DEVICE)


@pytest.mark.parametrize("case", MISMATCHES)
def test_mismatched_data_is_refused(groomed, case):
    with pytest.raises(HairError, match=r"\.$"):
        MISMATCHES[case](groomed)


def test_no_queries_find_nothing():
    """No queries find no neighbors, although the grid has no cell, which once made Blender crash."""
    indices, distances = hash_grid.neighbours(vectors(3), vectors(0), 1.0, 4)
    assert indices.shape == distances.shape == (0, 4)


def test_no_strands_follow_no_guides(groomed):
    """No strands follow no guides, in every stage."""
    guides, binding = groomed
    none = SurfacePoints(np.empty(0, np.int32), np.empty((0, 3), np.float32))
    bound = groom.bind_hair(SQUARE, guides, HairSettings(), roots=none, device=DEVICE)
    assert following.follow_guides(bound, guides).points.shape == (0, 41)
    points, shares = following.follow_some(binding, guides, np.empty(0, np.int64))
    assert points.shape == (0, 41, 3) and shares.shape == (0, 8)


@pytest.mark.parametrize("indices", [[], [0], [0, 6], [[3, 4], [5, 6]]])
def test_indices_within_a_count_are_taken(indices):
    require_indices("things", np.array(indices, np.int32), 7)
    if np.size(indices):
        with pytest.raises(HairError):
            require_indices("things", np.array(indices, np.int32), int(np.max(indices)))
