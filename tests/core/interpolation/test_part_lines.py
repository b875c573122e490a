# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths to guides around part lines have the shortest length, and change continuously."""

import heapq
from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.interpolation import part_lines
from tests.core.interpolation.test_guide_weights import dense, flat, steepest, up, vectors
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid, subdivided_sphere
from tests.support.strands.finding import find_guides


@pytest.fixture(scope="module")
def ground():
    """Return a flat unit square, from 0 to 1."""
    mesh = flat_grid(16)
    low, high = mesh.vertices[:, :2].min(axis=0), mesh.vertices[:, :2].max(axis=0)
    assert np.allclose(mesh.vertices[:, 2], 0.0)
    mesh.vertices[:, :2] = (mesh.vertices[:, :2] - low) / (high - low)
    return mesh


def segments(*corners):
    """Return (L, 2, 3) segments of a polyline on flat ground."""
    places = flat(corners)
    return np.stack([places[:-1], places[1:]], axis=1)


def ways_between(ground, lines, roots, guide_roots):
    """Return (S, G): the length of each path."""
    laid = part_lines.lay(ground, lines, DEVICE)
    apart = np.linalg.norm(np.asarray(roots)[:, None] - np.asarray(guide_roots)[None], axis=-1)
    order = np.argsort(apart, axis=1, kind="stable")
    candidates = wp.array(order.astype(np.int32), device=DEVICE)
    ways = wp.array(np.take_along_axis(apart, order, axis=1).astype(np.float32), device=DEVICE)
    count, guide_count = len(roots), len(guide_roots)
    part_lines.go_around(
        laid, vectors(flat(roots)), up(count), vectors(flat(guide_roots)), up(guide_count), candidates, ways
    )
    found, lengths = candidates.numpy(), ways.numpy()
    assert np.all(lengths[:, 1:] >= lengths[:, :-1])
    unsorted = np.empty((count, guide_count))
    np.put_along_axis(unsorted, found, lengths, axis=1)
    return unsorted


def test_a_way_that_crosses_nothing_is_straight(ground, rng):
    roots, guides = rng.random((50, 2)) * (1.0, 0.45), rng.random((40, 2)) * (1.0, 0.45)
    ways = ways_between(ground, segments((0.2, 0.5), (0.8, 0.5)), roots, guides)
    np.testing.assert_allclose(ways, np.linalg.norm(roots[:, None] - guides[None], axis=-1), rtol=1e-5)


def test_a_way_across_a_straight_line_goes_round_the_nearer_end(ground, rng):
    ends = np.array([(0.3, 0.5), (0.7, 0.5)])
    roots, guides = rng.random((60, 2)) * (1.0, 0.5), rng.random((60, 2)) * (1.0, 0.5) + (0.0, 0.5)
    meet = roots[:, None] + (0.5 - roots[:, None, 1:]) / (guides[None] - roots[:, None])[..., 1:] * (
        guides[None] - roots[:, None]
    )
    crosses = (meet[..., 0] > 0.3) & (meet[..., 0] < 0.7)
    straight = np.linalg.norm(roots[:, None] - guides[None], axis=-1)
    by_ends = np.linalg.norm(roots[:, None] - ends, axis=-1)[:, None] + np.linalg.norm(guides[:, None] - ends, axis=-1)
    np.testing.assert_allclose(
        ways_between(ground, segments(*ends), roots, guides),
        np.where(crosses, by_ends.min(axis=-1), straight),
        rtol=1e-4,
        atol=1e-5,
    )


def shortest_ways(corners, roots, guides):
    """Return (S, G) shortest lengths through the plane by brute force, over places just beside the corners of a
    polyline.
    """
    corners = np.asarray(corners, float)
    edges = np.diff(corners, axis=0) / np.linalg.norm(np.diff(corners, axis=0), axis=1, keepdims=True)
    apex = 1e-5 * (edges[:-1] - edges[1:])
    corners_beside = np.concatenate(
        [corners[:1] - 1e-5 * edges[:1], corners[-1:] + 1e-5 * edges[-1:], corners[1:-1] + apex, corners[1:-1] - apex]
    )
    places = np.concatenate([corners_beside, roots, guides])
    walls = list(pairwise(corners))

    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def is_free(a, b):
        return not any(side(a, b, c) * side(a, b, d) <= 1e-14 and side(c, d, a) * side(c, d, b) < 0.0 for c, d in walls)

    count = len(places)
    apart = np.full((count, count), np.inf)
    for i in range(count):
        for j in range(i):
            if is_free(places[i], places[j]):
                apart[i, j] = apart[j, i] = np.linalg.norm(places[i] - places[j])
    ways = np.empty((len(roots), len(guides)))
    for row in range(len(roots)):
        best, queue = {}, [(0.0, len(corners_beside) + row)]
        while queue:
            length, place = heapq.heappop(queue)
            if place not in best:
                best[place] = length
                for other in np.flatnonzero(np.isfinite(apart[place])):
                    heapq.heappush(queue, (length + apart[place, other], other))
        ways[row] = [best[len(corners_beside) + len(roots) + column] for column in range(len(guides))]
    return ways


CORNERS = {
    "a bend": [(0.3, 0.3), (0.5, 0.6), (0.7, 0.3)],
    "a hook": [(0.3, 0.2), (0.3, 0.7), (0.6, 0.7), (0.6, 0.5)],
    "a wave": [(0.2, 0.5), (0.35, 0.6), (0.5, 0.4), (0.65, 0.6), (0.8, 0.5)],
}


@pytest.mark.parametrize("corners", CORNERS.values(), ids=CORNERS)
def test_ways_are_never_longer_than_the_shortest_there_is(ground, rng, corners):
    """Paths are at least as long as the straight path and at most as long as the shortest detour, and mostly equal
    to it.
    """
    roots, guides = 0.1 + 0.8 * rng.random((25, 2)), 0.1 + 0.8 * rng.random((25, 2))
    straight = np.linalg.norm(roots[:, None] - guides[None], axis=-1)
    shortest = shortest_ways(corners, roots, guides)
    ways = ways_between(ground, segments(*corners), roots, guides)
    assert np.all(ways <= shortest * (1.0 + 1e-4)) and np.all(ways >= straight * (1.0 - 1e-4))
    detour = shortest > 1.001 * straight
    assert detour.sum() > 40
    assert (ways[detour] > 0.95 * shortest[detour]).mean() > 0.8


def test_a_closed_line_leaves_no_way_in_or_out(ground, rng):
    roots, guides = rng.random((80, 2)), rng.random((60, 2))
    ways = ways_between(ground, segments((0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7), (0.3, 0.3)), roots, guides)
    inside, inside_too = (np.all(np.abs(places - 0.5) < 0.2, axis=1) for places in (roots, guides))
    parted = inside[:, None] != inside_too
    parted_ways = np.where(parted, ways, np.inf)
    assert np.isinf(parted_ways).sum() >= parted_ways.size - len(roots)  # a root that sees none keeps its nearest
    assert np.all(np.isfinite(ways[~parted]))


@pytest.mark.parametrize("corners", [[(0.0, 0.5), (1.0, 0.5)], [(0.005, 0.5), (0.99, 0.5)], [(-0.2, 0.5), (1.3, 0.5)]])
def test_there_is_no_way_round_beyond_the_border(ground, rng, corners):
    """No path leads around a line beyond the border, whether the line ends at the border, before it or beyond it."""
    roots, guide_roots = rng.random((800, 2)), rng.random((100, 2))
    weights = parted_weights(ground, segments(*corners), roots, guide_roots)
    assert np.all(weights[(roots[:, None, 1] > 0.5) != (guide_roots[:, 1] > 0.5)] == 0.0)


def test_there_is_no_way_through_where_lines_meet(ground, rng):
    """No path leads through the point where lines meet as a T."""
    lines = np.concatenate([segments((0.0, 0.5), (1.0, 0.5)), segments((0.5, 0.0), (0.5, 0.497))])
    roots, guide_roots = rng.random((800, 2)), rng.random((150, 2))
    weights = parted_weights(ground, lines, roots, guide_roots)
    parts, its_parts = (np.where(p[:, 1] > 0.5, 2, p[:, 0] > 0.5) for p in (roots, guide_roots))
    assert np.all(weights[parts[:, None] != its_parts] == 0.0)


def parted_weights(ground, lines, roots, guide_roots, distance=None, limit=8):
    found = find_guides(
        vectors(flat(roots)),
        up(len(roots)),
        vectors(flat(guide_roots)),
        up(len(guide_roots)),
        distance,
        limit,
        lines=part_lines.lay(ground, lines, DEVICE),
    )
    return dense(found, len(guide_roots))


def test_weights_change_without_a_step_around_an_end(ground, rng):
    """Weights change without a step along half a circle around the end of a line, from one side to the other."""
    guide_roots = rng.random((200, 2))
    angle = np.linspace(-np.pi + 0.01, np.pi - 0.01, 20_001)
    for radius in (0.02, 0.06):
        path = np.array([0.5, 0.5]) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        line = segments((0.1, 0.5), (0.5, 0.5))
        fine, coarse = (steepest(parted_weights(ground, line, path[::n], guide_roots), path[::n]) for n in (1, 10))
        assert fine < 400.0 and fine < 1.5 * coarse


def test_a_line_that_ends_separates_no_farther_than_the_way_round_is_longer(ground, rng):
    """Behind its end a line separates roots no farther than the detour is longer; they follow guides of both sides."""
    guide_roots = rng.random((300, 2))
    roots = np.array([0.65, 0.4]) + (0.3, 0.2) * rng.random((200, 2))
    line = segments((0.1, 0.5), (0.5, 0.5))
    free = find_guides(vectors(flat(roots)), up(200), vectors(flat(guide_roots)), up(300), None, 8)
    np.testing.assert_allclose(parted_weights(ground, line, roots, guide_roots), dense(free, 300), atol=1e-5)


def test_lines_lie_on_the_surface():
    """Lines lie on the surface: a chord through a sphere becomes an arc, and does not part what is behind the
    sphere.
    """
    sphere = subdivided_sphere(4)
    arc = np.array([[(-0.6, 0.0, 0.8), (0.6, 0.0, 0.8)]])
    laid = part_lines.lay(sphere, arc, DEVICE)
    np.testing.assert_allclose(np.linalg.norm(laid.points.numpy(), axis=1), 1.0, atol=0.01)
    i = np.arange(400) + 0.5
    z, turn = 1.0 - 2.0 * i / 400, np.pi * (1.0 + 5.0**0.5) * i
    places = np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)
    guides, roots = vectors(places), vectors(places[::-1] * np.array([1.0, -1.0, 1.0]))
    parted, free = (
        dense(find_guides(roots, roots, guides, guides, None, 8, lines=lines), 400) for lines in (laid, None)
    )
    places_of_roots = roots.numpy()
    below = places_of_roots[:, 2] < 0.5
    np.testing.assert_allclose(parted[below], free[below], atol=1e-6)
    middle = (
        (np.abs(places_of_roots[:, 0]) < 0.3) & (places_of_roots[:, 2] > 0.0) & (np.abs(places_of_roots[:, 1]) < 0.2)
    )
    assert middle.sum() >= 5
    across = places_of_roots[:, None, 1] * places[None, :, 1] < 0.0
    assert np.all(parted[middle][across[middle]] == 0.0) and np.any(free[middle][across[middle]] > 0.05)


def test_a_line_of_thousands_of_points_is_laid_with_hundreds(ground, rng):
    """A line of thousands of points is simplified to hundreds, as strands look at each point."""
    turn = np.linspace(0.0, np.pi, 5000)
    fine = 0.5 + 0.3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    assert len(part_lines.lay(ground, segments(*fine), DEVICE).points) < 300
    roots, guides = 0.1 + 0.8 * rng.random((40, 2)), 0.1 + 0.8 * rng.random((40, 2))
    of_fine, of_coarse = (
        ways_between(ground, segments(*np.concatenate([fine[:-1:every], fine[-1:]])), roots, guides)
        for every in (1, 40)
    )
    near = np.isclose(of_fine, of_coarse, rtol=5e-3)
    assert near.mean() > 0.99  # but where a way just touches one of the two


def test_edges_are_put_in_order(rng):
    """Shuffled edges of lines, a ring and a fork are put in order: every edge once, and each line continuously."""
    lines = [range(5), range(5, 7), [*range(7, 12), 7], [12, 13, 14], [13, 15]]
    edges = np.array([pair for line in lines for pair in pairwise(line)])
    for _ in range(20):
        shuffled = np.where(rng.random((len(edges), 1)) < 0.5, edges, edges[:, ::-1])[rng.permutation(len(edges))]
        ordered = part_lines.in_order(shuffled)
        np.testing.assert_array_equal(np.unique(np.sort(ordered), axis=0), np.unique(np.sort(edges), axis=0))
        assert len(ordered) == len(edges)
        goes_on = ordered[1:, 0] == ordered[:-1, 1]
        assert len(edges) - goes_on.sum() <= 6  # the fork is three lines, of which two may follow on each other


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        (np.empty((0, 2, 3)), "no segments"),
        (np.zeros((3, 3)), "no segments"),
        (np.full((1, 2, 3), np.nan), "non-finite"),
    ],
)
def test_refused_lines(ground, lines, sentence):
    with pytest.raises(HairError, match=sentence):
        part_lines.lay(ground, lines)


def test_a_line_without_length_parts_nothing(ground, rng):
    roots, guides = rng.random((50, 2)), rng.random((40, 2))
    ways = ways_between(ground, segments((0.5, 0.5), (0.5, 0.5)), roots, guides)
    np.testing.assert_allclose(ways, np.linalg.norm(roots[:, None] - guides[None], axis=-1), rtol=1e-4)
