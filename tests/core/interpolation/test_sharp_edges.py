# SPDX-License-Identifier: GPL-3.0-or-later
"""At sharp edges and on thin sheets, strands follow guides of their own face."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.interpolation import sharp_edges
from tests.support.devices import DEVICE
from tests.support.strands.finding import find_guides, strands_between


def unit(array):
    return array / np.linalg.norm(array, axis=-1, keepdims=True)


def folded(places, edge):
    """Return roots and normals (N, 3) at places (N, 2) of a plane that is folded along x = 0 by an angle [rad]."""
    is_wall = places[:, :1] > 0.0
    roots = np.stack([places[:, 0], places[:, 1], np.zeros(len(places))], axis=1)
    folds = places[:, :1] * [np.cos(edge), 0.0, -np.sin(edge)] + roots * [0.0, 1.0, 0.0]
    return np.where(is_wall, folds, roots), np.where(is_wall, (np.sin(edge), 0.0, np.cos(edge)), (0.0, 0.0, 1.0))


def angles_at(edge, length):
    """Return (S,) angles [deg] between strands and the parallel guides across an edge [deg]."""
    rng, turn = np.random.default_rng(4), np.radians(edge)
    (roots, normals), (guide_roots, guide_normals) = (
        folded(rng.uniform(-0.2, 0.2, (count, 2)), turn) for count in (3000, 200)
    )
    hanging = unit(np.array([np.sin(0.5 * turn), 0.2, np.cos(0.5 * turn)]))
    guides = guide_roots[:, None] + np.linspace(0.0, length, 9)[:, None] * hanging
    strands = strands_between(roots, normals, guides, guide_normals)
    return np.degrees(np.arccos(np.clip(unit(strands[:, -1] - roots) @ hanging, -1.0, 1.0)))


@pytest.mark.parametrize("length", [0.02, 0.3])
def test_parallel_hair_flares_at_no_edge_more_than_at_58_degrees(length):
    """Without detours the 99th percentile of the angles is 40° at an edge of 90°, and 109° at 150°."""
    most = np.percentile(angles_at(58.0, length), 99)
    for edge in (65.0, 75.0, 90.0, 150.0, 180.0):
        assert np.percentile(angles_at(edge, length), 99) <= most


@pytest.mark.parametrize("guide_count", [8, 60])
def test_weights_change_without_a_step_around_an_edge(guide_count):
    """Around a rounded edge of 120°, changes of all weights shrink with the steps."""
    rng = np.random.default_rng(2)

    def rounded(along, across):
        turn = np.clip(along / 0.02, -1.0, 1.0) * np.radians(60.0)
        normals = np.stack([np.sin(turn), 0.0 * turn, np.cos(turn)], axis=1)
        tangents = np.stack([np.cos(turn), 0.0 * turn, -np.sin(turn)], axis=1)
        straight = (along - np.clip(along, -0.02, 0.02))[:, None] * tangents
        return 0.02 * normals + straight + across[:, None] * [0.0, 1.0, 0.0], normals

    guide_roots, guide_normals = rounded(*rng.uniform(-0.2, 0.2, (2, guide_count)))
    along = np.linspace(-0.1, 0.1, 20_001)
    steepest = {}
    for every in (1, 10):
        roots, normals = rounded(along[::every], 0.3 * along[::every])
        frames = (np.float32(array) for array in (roots, normals, guide_roots, guide_normals))
        found = find_guides(*(wp.array(array, dtype=wp.vec3, device=DEVICE) for array in frames), None, 6)
        indices, weights = found.indices.numpy(), found.weights.numpy()
        full = np.zeros((len(roots), guide_count + 1))
        np.put_along_axis(full, indices, weights, axis=1)  # index -1: the last column, unused
        steepest[every] = np.abs(np.diff(full[:, :-1], axis=0)).sum(axis=1).max() / every
    assert steepest[1] < 1.5 * steepest[10]


def test_last_paths_stay_last_also_where_part_lines_make_other_paths_longer(rng):
    """Beside a part line the last path limits the weights, and is no path to the last guide."""
    normals = unit(rng.normal(size=(60, 3)))
    guide_normals = unit(rng.normal(size=(30, 3)))
    candidates = rng.permuted(np.tile(np.arange(30), (60, 1)), axis=1)[:, :9].astype(np.int32)
    ways = np.sort(rng.uniform(0.1, 1.0, (60, 9)).astype(np.float32), axis=1)
    ways[:, -1] *= np.float32(0.6)
    found, lengths = wp.array(candidates, device=DEVICE), wp.array(ways, device=DEVICE)
    frames = [wp.array(np.float32(array), dtype=wp.vec3, device=DEVICE) for array in (normals, guide_normals)]
    sharp_edges.go_around(*frames, found, lengths)
    after, after_lengths = found.numpy(), lengths.numpy()
    assert np.array_equal(after[:, -1], candidates[:, -1]) and np.array_equal(after_lengths[:, -1], ways[:, -1])
    assert (np.diff(after_lengths[:, :-1], axis=1) >= 0.0).all() and (after_lengths >= ways).all()
    assert np.array_equal(np.sort(after, axis=1), np.sort(candidates, axis=1))
