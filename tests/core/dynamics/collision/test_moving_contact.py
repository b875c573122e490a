# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact with moving colliders: displacement, sides of sheets, no tunnelling and no missed contacts."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.collision.colliders import Collider, Colliders
from hair_addon.core.dynamics.collision.contact import Contacts
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.brute_force import distances, is_inside
from tests.support.dynamics.contacts import (
    STEP,
    Asked,
    around,
    bumpy,
    gaps_of,
    groom_of,
    is_plane,
    lanes_of,
    sheet,
    slab,
)
from tests.support.meshes import flat_grid, subdivided_sphere


@pytest.mark.parametrize("substeps", [1, 4])
def test_the_displacement_is_the_surfaces(device, rng, substeps):
    """The displacement at a contact is exact for a rigid motion: that of the touched point, divided among the
    substeps.
    """
    mesh, turn, shift = bumpy(rng), Rotation.from_rotvec([0.02, -0.05, 0.04]), np.array([0.003, 0.001, -0.004])
    after = TriMesh((turn.apply(mesh.vertices) + shift).astype(np.float32), mesh.triangles)
    colliders = Colliders(device)
    for pose in (mesh, after):
        colliders.read([Collider("a", pose)])
    for step in range(substeps):
        part = (step + 1) / substeps
        colliders.pose(part)
        now = TriMesh((mesh.vertices + part * (after.vertices - mesh.vertices)).astype(np.float32), mesh.triangles)
        points = around(rng, now, 300)
        planes = Asked(colliders, len(points))(points)
        found = is_plane(planes)
        points, planes = points[found], planes[found]
        foot = points - (gaps_of(planes, points) + 1e-3)[:, None] * planes[:, :3]
        # But for points that it has passed over, whose plane is where they went in.
        is_foot = distances(foot, now) < 1e-6
        assert is_foot.mean() > 0.9
        foot, planes = foot[is_foot], planes[is_foot]
        # foot = (1 - part) x + part (R x + shift) for the point x of the first pose.
        motion = part * (turn.as_matrix() - np.eye(3))
        x = np.linalg.solve(np.eye(3) + motion, (foot - part * shift).T).T
        np.testing.assert_allclose(planes[:, 4:7], (turn.apply(x) + shift - x) / substeps, atol=1e-6)


def test_a_point_that_is_not_asked_has_no_plane_to_miss(device, rng):
    """A point that is not queried misses no plane: strands that drift about a turning, swelling mesh have the same
    planes.
    """
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, is_double_sided=True), Collider("b", flat_grid(2, 0.05), is_double_sided=True)])
    count = 6
    strands = rng.uniform(-0.12, 0.12, (160, 1, 3)) + np.cumsum(rng.normal(0, 0.004, (160, count, 3)), axis=1)
    sparing, asking = (Contacts(lanes_of(strands, device), colliders) for _ in range(2))
    speeds = rng.choice([0.0, 1e-5, 2e-4, 0.004], (160, 1, 1))
    spared = found = 0
    for frame in range(4):
        turn, size = Rotation.from_rotvec([0.0, 0.0, 0.05 * frame]), 1.0 + 0.1 * frame
        now = TriMesh((size * turn.apply(mesh.vertices)).astype(np.float32), mesh.triangles)
        sheet = Collider("b", flat_grid(2, 0.05), is_double_sided=True)
        colliders.read([Collider("a", now, is_double_sided=True), sheet])
        for step in range(6):
            colliders.pose((step + 1) / 6)
            last, strands = strands, strands + speeds * rng.normal(size=(160, 1, 3))
            there, before = lanes_of(strands, device), lanes_of(last, device)
            held = sparing.vertices.asked.numpy().copy()
            planes = sparing.find(there, before, STEP).numpy().copy()
            np.testing.assert_array_equal(planes, asking.find(there, before, STEP, is_skipping=False).numpy())
            spared += (held == sparing.vertices.asked.numpy()).mean() / 24
            found += np.any(planes, axis=1).mean() / 24
            final = sparing.find(there, before, STEP, is_final=True).numpy().copy()
            np.testing.assert_array_equal(
                final, asking.find(there, before, STEP, is_final=True, is_skipping=False).numpy()
            )
            is_moved = rng.random((160, 1, 1)) < 0.02
            strands = strands + 0.001 * is_moved * rng.normal(size=(160, 1, 3))
            there, moved = lanes_of(strands, device), lanes_of(is_moved.repeat(3, axis=2), device)
            again = sparing.find(there, before, STEP, is_final=True, moved=moved).numpy().copy()
            np.testing.assert_array_equal(
                again, asking.find(there, before, STEP, is_final=True, is_skipping=False).numpy()
            )
    assert spared > 0.1 and found > 0.1


@pytest.mark.parametrize("kind", ["sheet", "slab"])
@pytest.mark.parametrize("who_moves", ["points", "collider", "both", "bending collider"])
def test_fast_points_do_not_pass_through(device, rng, kind, who_moves):
    """Fast points, and points at rest before a moving collider, stay in front of it at the distance."""
    mesh = sheet(rng) if kind == "sheet" else slab(rng)
    collider = {"is_double_sided": kind == "sheet"}
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, **collider)])
    count = 300
    last = rng.uniform(-0.07, 0.07, (count, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.02]
    below = rng.random(count) < 0.5
    last[below, 2] *= -1.0
    asked = Asked(colliders, count)
    asked(last)
    by = np.zeros(3)
    if who_moves != "points":
        by = np.array([0.001, -0.002, 0.05])
        below[:] = False
        last[:, 2] = np.abs(last[:, 2])
    points = last.copy()
    if who_moves in {"points", "both"}:
        points += rng.uniform(-0.03, 0.03, (count, 3)) * [1.0, 1.0, 0.0]
        points[:, 2] = np.where(below, 1, -1) * rng.uniform(0.005, 0.04, count)
    bent = np.zeros_like(mesh.vertices)
    if who_moves == "bending collider":
        bent[:, 2] = 0.02 * np.sin(40.0 * mesh.vertices[:, 0])
    moved = TriMesh((mesh.vertices + by + bent).astype(np.float32), mesh.triangles)
    colliders.read([Collider("a", moved, **collider)])
    colliders.pose(1.0)
    planes = asked(points, last)
    assert is_plane(planes).all()
    np.testing.assert_array_equal(planes[:, 2] < 0.0, below)
    assert (gaps_of(planes, points) < -1e-3).all()
    if who_moves == "bending collider":
        assert np.abs(planes[:, 4:7] - by).max() <= 0.0201
    else:
        np.testing.assert_allclose(planes[:, 4:7], np.tile(by, (count, 1)), atol=1e-6)


def test_a_collider_that_swells_over_still_points_takes_them_along(device):
    """A collider that swells over resting points by far more than they keep takes the points along."""
    grid = flat_grid(6, 0.2)
    points = grid.vertices + np.float32([0.0, 0.0, 0.004])
    rise = 0.05 * (np.exp(-(((points[:, :2] - 0.1) / 0.05) ** 2).sum(axis=1)) - 0.2)
    swollen = TriMesh((grid.vertices + rise[:, None] * [0.0, 0.0, 1.0]).astype(np.float32), grid.triangles)
    colliders = Colliders(device)
    for mesh in (grid, swollen):
        colliders.read([Collider("a", mesh, is_double_sided=True)])
    asked = Asked(colliders, len(points), points)
    colliders.pose(1.0)
    planes = asked(points)
    passed = rise > 0.006
    assert passed.sum() > 4 and is_plane(planes)[passed].all()
    assert (planes[passed, 2] > 0.0).all() and (gaps_of(planes, points)[passed] < -1e-3).all()


def test_a_double_sided_collider_keeps_the_side_of_a_point(device, rng):
    """A point that is pressed slowly through a double-sided collider is returned to its own side, at any time."""
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(4, 0.1), distance=1e-3, is_double_sided=True)])
    points = np.concatenate([rng.uniform(0.01, 0.09, (32, 2)), np.repeat([[0.0005], [-0.0005]], 16, axis=0)], axis=1)
    side = np.sign(points[:, 2])
    asked = Asked(colliders, 32, points)
    for height in (0.0004, 0.0001, 0.0, -0.0003, -0.0008):
        last, points = points, np.concatenate([points[:, :2], (side * height)[:, None]], axis=1)
        planes = asked(points, last)
        np.testing.assert_allclose(planes[:, :3] * side[:, None], np.tile([0.0, 0.0, 1.0], (32, 1)), atol=1e-6)
        np.testing.assert_allclose(gaps_of(planes, points), height - 0.0005, atol=1e-7)
    angles = np.linspace(0.5 * np.pi, -0.5 * np.pi, 40)
    way = np.stack([0.1 + 0.0008 * np.cos(angles), np.full(40, 0.05), 0.0008 * np.sin(angles)], axis=1)
    way = np.concatenate([way[:1] - [0.01, 0, 0], way, way[-1:] - [0.01, 0, 0]])
    asked = Asked(colliders, 1, way[:1])
    for last, place in pairwise(way):
        planes = asked(place[None], last[None])
        assert gaps_of(planes, place[None])[0] > -0.00021


def test_a_collider_that_appears_is_found_by_points_that_were_far_from_any(device):
    ball = subdivided_sphere(2, 0.1)
    colliders = Colliders(device)
    colliders.read([Collider("a", ball)])
    points = 1.004 * ball.vertices[:8].astype(np.float64) + [1.0, 0.0, 0.0]
    asked = Asked(colliders, 8)
    for _ in range(3):
        assert not asked(points).any()
    colliders.read([Collider("a", ball), Collider("b", TriMesh(ball.vertices + np.float32([1, 0, 0]), ball.triangles))])
    assert is_plane(asked(points)).all()
    colliders.read([Collider("a", ball)])
    assert not asked(points).any()


def test_a_state_gives_the_same_planes(device, rng):
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, is_double_sided=True)])
    strands = groom_of(rng, mesh, 80, 0.004)
    contacts = Contacts(lanes_of(strands, device), colliders)
    for _ in range(5):
        last, strands = strands, strands + rng.normal(0, 0.001, strands.shape).astype(np.float32)
        contacts.find(lanes_of(strands, device), lanes_of(last, device), STEP)
    other = Contacts(lanes_of(strands + 1.0, device), colliders)
    other.load(contacts.state())
    planes = [c.find(lanes_of(strands, device), lanes_of(last, device), STEP).numpy() for c in (contacts, other)]
    np.testing.assert_array_equal(*planes)
    for wrong in ({}, {**contacts.state(), "vertex_rest": np.zeros((1, 2, 3), np.float32)}):
        with pytest.raises(HairError):
            other.load(wrong)


def test_points_pushed_along_their_planes_stay_outside_of_a_shaken_mesh(device, rng):
    """Points pushed along their planes are inside a mesh shaken at 660°/s and 3 Hz by less than a micrometer."""
    ball = subdivided_sphere(3)
    ball = TriMesh(ball.vertices * np.float32([0.08, 0.095, 0.12]), ball.triangles)
    colliders = Colliders(device)
    colliders.read([Collider("a", ball)])
    points = 1.02 * ball.vertices[rng.integers(len(ball.vertices), size=240)].astype(np.float64)
    velocities = np.zeros_like(points)
    asked = Asked(colliders, len(points), points)
    step, touched = 1.0 / (24 * 8), 0
    for frame in range(8):
        turn = Rotation.from_rotvec([0.0, 0.0, 1.2 * np.sin(0.4 * (frame + 1))])
        shift = np.array([0.05 * np.sin(0.8 * (frame + 1)), 0.0, 0.0])
        colliders.read([Collider("a", TriMesh((turn.apply(ball.vertices) + shift).astype(np.float32), ball.triangles))])
        for part in np.arange(1, 9) / 8:
            colliders.pose(part)
            last, pull = points, -20.0 * points / np.linalg.norm(points, axis=1, keepdims=True)
            velocities = velocities + step * pull
            points = points + step * velocities
            for is_final in (False, True):
                planes = asked(points, last, is_final=is_final)
                behind = np.where(is_plane(planes), np.maximum(-gaps_of(planes, points), 0.0), 0.0)
                points = points + behind[:, None] * planes[:, :3]
                touched += (behind > 0.0).mean() / 128
            velocities = (points - last) / step
            now = TriMesh(colliders.mesh.points.numpy(), ball.triangles)
            some = points[rng.integers(len(points), size=12)]
            assert not is_inside(some, now).any() and distances(some, now).min() > 1e-3 - 1e-6
    assert touched > 0.2
