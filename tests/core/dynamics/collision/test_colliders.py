# SPDX-License-Identifier: GPL-3.0-or-later
"""Colliders between two poses; unusable colliders are left out and named."""

import numpy as np
import pytest
import warp as wp
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.collision.colliders import Collider, Colliders
from hair_addon.core.dynamics.collision.contact import WIDTH, Contacts
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.dynamics.contacts import bumpy
from tests.support.meshes import flat_grid, subdivided_sphere

BALL = subdivided_sphere(1, 0.1)


def moved(mesh, by):
    return TriMesh(mesh.vertices + np.asarray(by, np.float32), mesh.triangles)


def notes_of(colliders):
    return [str(note) for note in colliders.notes]


def finds(colliders, place):
    """Whether a point at a place finds a contact plane."""
    strand = np.repeat(np.tile(np.array(place, np.float32), 2).reshape(1, 6, 1), WIDTH, axis=2)
    positions = wp.array(strand, dtype=float, device=colliders.device)
    far = wp.array(strand + np.float32(9.0), dtype=float, device=colliders.device)
    return bool(Contacts(far, colliders).find(positions, positions, 0.01).numpy().any())


def test_poses_lie_on_lines_between_frames(device, rng):
    colliders = Colliders(device)
    colliders.read([Collider("a", BALL), Collider("b", flat_grid(2))])
    assert colliders.largest_motion == 0.0
    first = np.concatenate([BALL.vertices, flat_grid(2).vertices])
    other = TriMesh(rng.normal(size=BALL.vertices.shape).astype(np.float32), BALL.triangles)
    colliders.read([Collider("a", other), Collider("b", moved(flat_grid(2), (0.0, 0.5, 0.0)))])
    second = np.concatenate([other.vertices, moved(flat_grid(2), (0.0, 0.5, 0.0)).vertices])
    last = first
    for part in (0.25, 0.5, 1.0):
        colliders.pose(part)
        points = colliders.mesh.points.numpy().copy()
        np.testing.assert_allclose(points, first + part * (second - first), atol=1e-6)
        np.testing.assert_array_equal(colliders.previous.numpy(), last)
        turn, shift = colliders.rigid_motion
        others = np.linalg.norm(points - last @ turn.T - shift, axis=1).max()
        assert others <= colliders.motion + 1e-6
        last = points
    np.testing.assert_array_equal(last, second)
    colliders.read([Collider("a", other), Collider("b", moved(flat_grid(2), (0.0, 0.5, 0.0)))])
    colliders.pose(1.0)
    assert colliders.motion == 0.0
    np.testing.assert_array_equal(colliders.previous.numpy(), second)


def test_rigid_motions_lead_back_to_the_beginning(rng):
    colliders = Colliders()
    for frame in range(5):
        turn = Rotation.from_rotvec(0.1 * rng.normal(size=3)) if frame else Rotation.identity()
        now = TriMesh((turn.apply(BALL.vertices) + 0.02 * frame).astype(np.float32), BALL.triangles)
        colliders.read([Collider("a", now)])
        for part in (0.3, 1.0):
            colliders.pose(part)
            assert colliders.motion < 0.05 * 0.1
    turned, moved_by = colliders.rigid_motion_so_far
    np.testing.assert_allclose((colliders.mesh.points.numpy() - moved_by) @ turned, BALL.vertices, atol=2e-6)


def with_nan(mesh):
    vertices = mesh.vertices.copy()
    vertices[3, 1] = np.nan
    return TriMesh(vertices, mesh.triangles)


BAD = {
    "no faces": TriMesh(BALL.vertices, np.zeros((0, 3), np.int32)),
    "no vertices": TriMesh(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)),
    "NaN": with_nan(BALL),
    "infinite": TriMesh(np.full_like(BALL.vertices, np.inf), BALL.triangles),
    "far": TriMesh(BALL.vertices * np.float32(1e30), BALL.triangles),
    "index": TriMesh(BALL.vertices, BALL.triangles + np.int32(1)),
    "negative index": TriMesh(BALL.vertices, BALL.triangles - np.int32(1)),
    "point": TriMesh(0 * BALL.vertices, BALL.triangles),
    "line": TriMesh(BALL.vertices * np.array([1, 0, 0], np.float32), BALL.triangles),
    "shape": TriMesh(BALL.vertices[:, :2], BALL.triangles),
    "type": TriMesh(BALL.vertices, BALL.triangles.astype(np.int64)),
}


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("kind", BAD)
def test_a_bad_collider_is_left_out_and_named_while_the_others_collide(device, kind):
    other = Collider("other", moved(BALL, (1.0, 0.0, 0.0)))
    colliders = Colliders(device)
    for frame in (1, 2):  # from the start, and again
        colliders.read([Collider("bad one", BAD[kind]), other], frame)
        assert (
            len(colliders.notes) == 1
            and f"bad one does not collide with hair in frame {frame}" in notes_of(colliders)[0]
        )
        assert colliders.names == ("other",)
        assert finds(colliders, (0.9, 0.0, 0.0)) and not finds(colliders, (0.1, 0.0, 0.0))
    colliders.read([Collider("bad one", BALL), other], 3)
    assert notes_of(colliders) == [] and finds(colliders, BALL.vertices[0])
    colliders.read([other], 4)
    assert notes_of(colliders) == [] and not finds(colliders, BALL.vertices[0])


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0, 1e9])
@pytest.mark.parametrize("name", ["friction", "distance"])
def test_settings_that_are_no_such_numbers_leave_a_collider_out(name, value):
    colliders = Colliders()
    colliders.read([Collider("a", BALL, **{name: value})], 7)
    assert len(colliders.notes) == 1 and name in notes_of(colliders)[0] and colliders.mesh is None
    assert not finds(colliders, BALL.vertices[0])


def test_a_collider_with_another_topology_stays_where_it_was(device):
    colliders = Colliders(device)
    finer = subdivided_sphere(2, 0.1)
    colliders.read([Collider("a", BALL)], 1)
    colliders.read([Collider("a", moved(BALL, (1.0, 0.0, 0.0)))], 2)
    for frame in (3, 4):
        colliders.read([Collider("a", moved(finer, (5.0, 0.0, 0.0)))], frame)
        assert len(colliders.notes) == 1 and f"frame {frame}" in notes_of(colliders)[0]
        colliders.pose(1.0)
        np.testing.assert_array_equal(colliders.mesh.points.numpy(), moved(BALL, (1.0, 0.0, 0.0)).vertices)
        assert colliders.motion == 0.0


def test_one_name_is_one_collider():
    colliders = Colliders()
    colliders.read([Collider("a", BALL), Collider("a", moved(BALL, (1.0, 0.0, 0.0)))])
    assert len(colliders.notes) == 1 and colliders.names == ("a",)


def test_a_collider_that_was_away_comes_back_without_a_motion(device):
    colliders = Colliders(device)
    far = Collider("a", moved(BALL, (3.0, 0.0, 0.0)))
    for given_colliders in ([Collider("a", BALL)], [], [far]):
        colliders.read(given_colliders)
    colliders.pose(0.5)
    assert colliders.motion == 0.0 and colliders.largest_motion == 0.0
    np.testing.assert_array_equal(colliders.mesh.points.numpy(), far.mesh.vertices)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@given(data=st.data())
def test_any_arrays_collide_or_are_named(data):
    """Arrays of any content are used as colliders or named as unusable, and other colliders remain in use."""
    coordinates = st.sampled_from([0.0, 0.1, 1.0, -1.0, 1e-30, 1e5, 1e7, 1e30, np.nan, np.inf])
    vertices = data.draw(st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=5))
    triangles = data.draw(st.lists(st.tuples(*[st.integers(-1, 5)] * 3), max_size=6))
    mesh = TriMesh(np.array(vertices, np.float32).reshape(-1, 3), np.array(triangles, np.int32).reshape(-1, 3))
    colliders = Colliders()
    colliders.read([Collider("any", mesh), Collider("other", moved(BALL, (50.0, 0.0, 0.0)))])
    assert len(colliders.names) + len(colliders.notes) == 2 and "other" in colliders.names
    colliders.pose(1.0)
    assert finds(colliders, (50.1, 0.0, 0.0))


def test_vertices_drift_no_farther_than_is_known(device, rng):
    """Vertices drift no farther from the collider's rigid motion than the stored bound in each substep, which turns
    do not raise.
    """
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh)])
    for frame in range(1, 7):
        turn, size = Rotation.from_rotvec([0.0, 0.1, 0.3 * frame]), 1.0 + 0.02 * max(frame - 3, 0)
        colliders.read([Collider("a", TriMesh((size * turn.apply(mesh.vertices)).astype(np.float32), mesh.triangles))])
        for part in (0.25, 0.5, 1.0):
            colliders.pose(part)
            turned, moved = colliders.rigid_motion_so_far
            drift = np.linalg.norm((colliders.mesh.points.numpy() - moved) @ turned - mesh.vertices, axis=1).max()
            known = colliders.drift_before + colliders.drift
            assert drift <= known + 1e-6 and known < drift + 0.01
        if frame <= 3:
            assert known < 1e-5
