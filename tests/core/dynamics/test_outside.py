# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands kept outside of colliders have no point inside, unmoved roots, and nearly the same lengths."""

import numpy as np
import pytest

from hair_addon.core.dynamics.outside import Barrier, moved_outside
from hair_addon.core.dynamics.simulation import Obstacle
from hair_addon.core.errors import HairError
from tests.support.meshes import HEAD, read_obj, subdivided_sphere

RADIUS, DISTANCE = 0.02, 1e-3


@pytest.fixture
def ball():
    """Return an `Obstacle` of 2 cm, 10 cm above the ground."""
    mesh = subdivided_sphere(4, RADIUS)
    return Obstacle("Ball", mesh.vertices + np.array([0.0, 0.0, 0.1]), mesh.triangles, distance=DISTANCE)


@pytest.fixture
def strands(rng):
    """Return (400, 41, 3): curled strands of 20 cm upward from a plane, a third of them through the ball."""
    along = np.linspace(0.0, 0.2, 41)
    curl = 0.004 * np.stack([np.sin(150.0 * along), np.cos(150.0 * along) - 1.0, 0.0 * along], axis=1)
    roots = np.concatenate([rng.uniform(-0.05, 0.05, (400, 2)), np.zeros((400, 1))], axis=1)
    straight = np.stack([0.0 * along, 0.0 * along, along], axis=1)
    return roots[:, None] + straight + curl


def from_middle(points):
    return np.linalg.norm(points - [0.0, 0.0, 0.1], axis=-1)


def lengths(points):
    return np.linalg.norm(np.diff(points, axis=1), axis=2)


def test_no_point_is_inside_and_lengths_nearly_stay(ball, strands, device):
    kept, is_moved = moved_outside(strands, [ball], device)
    a, b, c = np.moveaxis(ball.vertices[ball.triangles] - [0.0, 0.0, 0.1], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    inscribed = np.einsum("fx,fx->f", normals, a).min()
    assert from_middle(kept).min() > inscribed + DISTANCE - 2e-6
    assert (from_middle(strands) < RADIUS).any(axis=1).sum() > 30
    assert is_moved[(from_middle(strands) < RADIUS).any(axis=1)].all()
    np.testing.assert_array_equal(kept[:, 0], strands[:, 0])
    assert abs(lengths(kept).sum(axis=1) / lengths(strands).sum(axis=1) - 1.0).max() < 0.01


def test_strands_that_are_outside_stay_bit_by_bit(ball, strands, device):
    kept, is_moved = moved_outside(strands, [ball], device)
    is_far = (from_middle(strands) > RADIUS + DISTANCE + 1e-5).all(axis=1)
    assert is_far.sum() > 100 and not is_moved[is_far].any()
    np.testing.assert_array_equal(kept[~is_moved], strands[~is_moved])
    np.testing.assert_array_equal(moved_outside(kept, [ball], device)[0][~is_moved], strands[~is_moved])


def test_strands_do_not_depend_on_each_other(ball, strands, device):
    kept, _ = moved_outside(strands, [ball], device)
    order = np.random.default_rng(1).permutation(len(strands))
    np.testing.assert_allclose(moved_outside(strands[order], [ball], device)[0], kept[order], atol=1e-7)


def test_without_colliders_nothing_moves(strands, device):
    kept, is_moved = moved_outside(strands, [], device)
    assert kept is not None and not is_moved.any()
    np.testing.assert_array_equal(kept, strands)


def test_points_that_are_not_finite_are_refused(ball, strands, device):
    strands[3, 4, 1] = np.nan
    with pytest.raises(HairError, match="finite"):
        moved_outside(strands, [ball], device)


def test_segments_keep_their_lengths_in_notches(rng, device):
    """Segments keep their lengths in notches, for strands that turn into a head among eye sockets and ears."""
    head = read_obj(HEAD)
    corners = head.corners[rng.choice(np.flatnonzero(head.corners[:, :, 2].min(axis=1) > 0.66), 300)]
    roots = corners.mean(axis=1)
    inward = -np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    steps = np.linspace(-1.0, 2.0, 24)[None, :, None] * inward[:, None] + 0.5 * rng.normal(size=(300, 24, 3))
    steps *= 0.005 / np.linalg.norm(steps, axis=2, keepdims=True)
    strands = np.concatenate([roots[:, None], roots[:, None] + np.cumsum(steps, axis=1)], axis=1)
    obstacle = Obstacle("Head", head.vertices.astype(np.float64), head.triangles, distance=1e-4)
    barrier = Barrier([obstacle], roots.mean(axis=0), strands.shape[0] * strands.shape[1], device)
    kept, is_moved = barrier.moved(strands)
    assert is_moved.sum() > 50
    errors = np.abs(lengths(kept) / lengths(strands) - 1.0)
    assert np.quantile(errors, 0.999) < 1e-4 and errors.max() < 0.02  # beside a root in a notch
    again, is_inside = barrier.moved(kept)
    assert is_inside.sum() <= 3 and np.abs(again - kept).max() < 1e-4  # rounding at the distance that points keep
    held = np.full(300, 5)
    np.testing.assert_array_equal(barrier.moved(strands, held)[0][:, :5], strands[:, :5])


_MIRROR = np.diag([-1.0, 1.0, 1.0])
_TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@pytest.mark.parametrize(
    ("is_open", "axes"),
    [
        (False, np.eye(3)),
        (True, np.eye(3)),
        (False, 100.0 * _TURN),
        (False, 0.01 * _MIRROR),
        (True, np.diag([1.0, 2.0, 0.5]) @ _TURN),
    ],
)
def test_strands_that_are_known_again_are_moved_alike(rng, is_open, axes):
    """Events of a stroke move strands to the same bits, whether points are remembered or all are searched again."""
    mesh = read_obj(HEAD) if is_open else subdivided_sphere(3, 0.1)
    height = mesh.vertices[:, 2]
    faces = mesh.triangles[height[mesh.triangles].min(axis=1) > np.median(height)] if is_open else mesh.triangles
    corners = mesh.vertices[faces[rng.choice(len(faces), 200)]].astype(np.float64)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    strands = corners.mean(axis=1)[:, None] + np.linspace(0.0, 0.1, 21)[:, None] * outward[:, None]
    obstacle = Obstacle("Scalp", mesh.vertices.astype(np.float64), faces, distance=1e-4)
    searched, known = (Barrier([obstacle], np.zeros(3), strands.size // 3) for _ in range(2))
    chosen, held = rng.permutation(200), rng.choice([1, 1, 1, 3, 21], 200)
    moved_count = 0
    for event in range(12):
        way = 0.02 * np.array([np.cos(event), np.sin(event), -0.7]) - 0.02 * outward
        strands = strands + np.linspace(0.0, 1.0, 21)[:, None] * way[:, None] * rng.random((200, 1, 1))
        local = (strands[chosen] @ np.linalg.inv(axes).T).astype(np.float32)
        rows, wanted, is_same = searched.moved_local(local, axes, held[chosen])
        again = known.moved_local(local, axes, held[chosen], chosen)
        for one, other in zip(again, (rows, wanted, is_same), strict=True):
            np.testing.assert_array_equal(one, other)
        before = local.astype(np.float64) @ axes.T
        np.testing.assert_allclose(wanted[is_same], before[rows][is_same], atol=1e-7)
        whole, is_moved = searched.moved(before, held[chosen])
        np.testing.assert_array_equal(np.flatnonzero(is_moved), rows)
        np.testing.assert_allclose(whole[rows], wanted, atol=2e-5)  # turns of segments in notches add up rounding
        strands[chosen], moved_count = whole, moved_count + len(rows)
        chosen = rng.permutation(200)[: 150 + event]
    assert moved_count > 100
    local[7, 5, 1] = np.inf
    with pytest.raises(HairError, match="finite"):
        known.moved_local(local, axes, None, np.arange(len(local)))


def test_points_are_not_taken_for_outside_where_points_that_do_not_move_were_inside(rng):
    """Held points may be deep inside, where the search does not reach the surface; later all but the roots are free."""
    mesh = subdivided_sphere(2, 0.1)
    corners = mesh.vertices[mesh.triangles[:200]].astype(np.float64)
    inward = -corners.mean(axis=1) / np.linalg.norm(corners.mean(axis=1), axis=1, keepdims=True)
    strands = corners.mean(axis=1)[:, None] + np.linspace(0.0, 0.2, 21)[:, None] * inward[:, None]
    obstacle = Obstacle("Ball", mesh.vertices.astype(np.float64), mesh.triangles, distance=1e-4)
    searched, known = (Barrier([obstacle], np.zeros(3), strands.size // 3) for _ in range(2))
    for _event in range(8):
        held = rng.integers(1, 12, 200)
        wanted, _is_moved = searched.moved(strands, held)
        np.testing.assert_array_equal(known.moved(strands, held, np.arange(200))[0], wanted)
        strands = wanted + np.linspace(0.0, 1.0, 21)[:, None] * 0.04 * rng.normal(size=(200, 1, 3))
