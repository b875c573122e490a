# SPDX-License-Identifier: GPL-3.0-or-later
"""A transferred groom is exact on copies and nearly reversible on other meshes, and losses are reported."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.landmark_warp import Warp, between_boxes, through_landmarks
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.grooming.groom_transfer import TransferSurface, carried, places_by_uv, places_by_warp
from tests.support.meshes import flat_grid, subdivided_sphere
from tests.support.strands.combed import lengths, standing

TURN = np.linalg.qr(np.array([[0.4, -0.8, 0.3], [0.9, 0.2, -0.1], [0.1, 0.5, 0.9]]))[0]
TURN *= np.sign(np.linalg.det(TURN))
SIMILARITIES = {
    "turned": (1.7 * TURN, np.array([0.3, -2.0, 0.7])),
    "mirrored": (0.6 * TURN @ np.diag([-1.0, 1.0, 1.0]), np.array([-1.0, 0.5, 0.0])),
}
COUNT, POINTS = 60, 13


def hill(side_count, height=0.3):
    """Return a `TransferSurface` of a square hill of side_count² pairs of triangles, whose UVs are the square."""
    flat = flat_grid(side_count)
    x, y, _ = flat.vertices.T
    vertices = np.stack([x, y, height * np.sin(np.pi * x) * np.sin(2.0 * y + 0.5)], axis=1)
    return TransferSurface(TriMesh(vertices.astype(np.float32), flat.triangles), flat.vertices[flat.triangles][..., :2])


def copy_of(mesh, linear, offset):
    """Return a mesh mapped by a similarity, its faces turned outward; `swapped`: corners where that mirrors."""
    triangles = mesh.triangles if np.linalg.det(linear) > 0.0 else mesh.triangles[:, [0, 2, 1]]
    return TriMesh((mesh.vertices @ linear.T + offset).astype(np.float32), np.ascontiguousarray(triangles))


def combed(mesh, rng):
    points, roots, _ = standing(mesh, COUNT, rng, length=0.2, point_count=POINTS)
    return points, roots


def moved(source, target, roots, points, places):
    counts = np.full(len(points), points.shape[1])
    return carried(source, target, roots, points.reshape(-1, 3), counts, places).reshape(-1, *points.shape[1:])


@pytest.mark.parametrize("method", ["UV", "LANDMARKS", "AFFINE"])
@pytest.mark.parametrize("similarity", SIMILARITIES)
def test_a_turned_scaled_or_mirrored_copy_carries_the_same_groom(rng, method, similarity):
    ground, (linear, offset) = hill(9), SIMILARITIES[similarity]
    mesh = copy_of(ground.mesh, linear, offset)
    uvs = ground.corner_uvs if similarity == "turned" else ground.corner_uvs[:, [0, 2, 1]]
    points, roots = combed(ground.mesh, rng)
    if method == "UV":
        places = places_by_uv(ground, TransferSurface(mesh, uvs), roots)
    else:
        marks = rng.normal(size=(6, 3))
        warp = Warp(linear, offset) if method == "AFFINE" else through_landmarks(marks, marks @ linear.T + offset)
        places = places_by_warp(ground.mesh, mesh, roots, warp)
    assert (len(places.kept), places.lost_count) == (COUNT, 0)
    made = moved(ground.mesh, mesh, roots, points, places)
    np.testing.assert_allclose(made, points @ linear.T + offset, atol=3e-6)
    assert places.scale == pytest.approx(abs(np.linalg.det(linear)) ** (1.0 / 3.0), rel=1e-5)
    assert np.array_equal(made[:, 0], positions(mesh, places.roots))


def test_by_uv_a_groom_comes_back_from_another_topology(rng):
    ground, other = hill(24), hill(37)
    points, roots = combed(ground.mesh, rng)
    there = places_by_uv(ground, other, roots)
    on_other = moved(ground.mesh, other.mesh, roots, points, there)
    back = places_by_uv(other, ground, there.roots)
    made = moved(other.mesh, ground.mesh, there.roots, on_other, back)
    assert len(made) == COUNT
    apart = np.linalg.norm(made - points[there.kept][back.kept], axis=2).max(axis=1)
    # Of these lengths of 0.2 m: the two grids cut the hill into other triangles, by which roots are moved.
    assert apart.max() < 0.003
    np.testing.assert_allclose(lengths(made), lengths(points), rtol=0.01)


def test_by_the_nearest_surface_a_groom_comes_back_from_another_topology(rng):
    source = TriMesh(subdivided_sphere(3).vertices * np.float32([1.0, 0.8, 1.2]), subdivided_sphere(3).triangles)
    target = TriMesh(subdivided_sphere(4).vertices * np.float32([1.3, 1.0, 1.1]), subdivided_sphere(4).triangles)
    points, roots = combed(source, rng)
    there = places_by_warp(source, target, roots, between_boxes(source.vertices, target.vertices))
    on_other = moved(source, target, roots, points, there)
    back = places_by_warp(target, source, there.roots, between_boxes(target.vertices, source.vertices))
    made = moved(target, source, there.roots, on_other, back)
    assert len(made) == COUNT
    assert np.linalg.norm(made - points, axis=2).max() < 0.012
    np.testing.assert_allclose(lengths(made), lengths(points), rtol=0.04)  # of the median factor there, and back


def test_new_roots_are_nearest_by_brute_force(rng):
    source, target = subdivided_sphere(2), subdivided_sphere(3, 0.9)
    warp = Warp(np.eye(3), np.array([0.02, 0.0, -0.03]))
    _points, roots = combed(source, rng)
    places = places_by_warp(source, target, roots, warp, reach=0.2)
    wanted = warp.places(positions(source, roots))
    shares = np.array([(i, j, 8 - i - j) for i in range(9) for j in range(9 - i)]) / 8.0
    samples = np.einsum("sc,fci->fsi", shares, target.corners).reshape(-1, 3)
    nearest = np.linalg.norm(wanted[:, None] - samples[None], axis=2).min(axis=1)
    found = np.linalg.norm(positions(target, places.roots) - wanted, axis=1)
    assert (found <= nearest + 1e-6).all()
    assert (found >= nearest - 2e-3).all()  # the square of what samples are apart, over the distance


def test_what_has_no_place_is_counted_and_the_others_stay_the_same(rng):
    ground = hill(12)
    x = ground.mesh.corners[:, :, 0].mean(axis=1)
    half = TransferSurface(TriMesh(ground.mesh.vertices, ground.mesh.triangles[x < 0.5]), ground.corner_uvs[x < 0.5])
    points, roots = combed(ground.mesh, rng)
    is_there = positions(ground.mesh, roots)[:, 0] <= 0.5
    for places in (
        places_by_uv(ground, half, roots),
        places_by_warp(ground.mesh, half.mesh, roots, Warp(np.eye(3), np.zeros(3)), reach=1e-4),
    ):
        assert np.array_equal(places.kept, np.flatnonzero(is_there))
        assert (places.far_count, places.other_side_count) == (COUNT - len(places.kept), 0)
        made = moved(ground.mesh, half.mesh, roots, points, places)
        is_inside = points[is_there][:, 0, 0] < 0.5 - 1.0 / 12.0  # where normals are the same
        np.testing.assert_allclose(made[is_inside], points[is_there][is_inside], atol=2e-6)


def test_a_surface_that_faces_the_other_way_is_no_place(rng):
    ground = hill(8)
    back = TriMesh(ground.mesh.vertices, np.ascontiguousarray(ground.mesh.triangles[:, ::-1]))
    _points, roots = combed(ground.mesh, rng)
    with pytest.raises(HairError, match="No guide has found a place"):
        places_by_warp(ground.mesh, back, roots, Warp(np.eye(3), np.zeros(3)))


def test_lengths_are_kept_if_so_wanted(rng):
    ground, (linear, offset) = hill(9), SIMILARITIES["turned"]
    points, roots = combed(ground.mesh, rng)
    mesh = copy_of(ground.mesh, linear, offset)
    places = places_by_warp(ground.mesh, mesh, roots, Warp(linear, offset), scales=False)
    np.testing.assert_allclose(lengths(moved(ground.mesh, mesh, roots, points, places)), lengths(points), rtol=1e-5)


def test_a_guide_off_its_surface_is_as_far_off_the_other_and_guides_may_have_any_number_of_points(rng):
    ground, (linear, offset) = hill(9), SIMILARITIES["mirrored"]
    points, roots = combed(ground.mesh, rng)
    counts = rng.integers(1, POINTS + 1, COUNT)
    ragged = np.concatenate(
        [line[:count] + np.float32([0.0, 0.0, 0.01]) for line, count in zip(points, counts, strict=True)]
    )
    mesh = copy_of(ground.mesh, linear, offset)
    places = places_by_warp(ground.mesh, mesh, roots, Warp(linear, offset))
    made = carried(ground.mesh, mesh, roots, ragged, counts, places)
    np.testing.assert_allclose(made, ragged @ linear.T + offset, atol=3e-6)


def test_landmarks_are_met_and_their_derivatives_are_differences(rng):
    sources, targets = rng.normal(size=(7, 3)), rng.normal(size=(7, 3))
    warp = through_landmarks(sources, targets)
    np.testing.assert_allclose(warp.places(sources), targets, atol=1e-9)
    places, step = rng.normal(size=(20, 3)), 1e-6
    differences = [
        (warp.places(places + step * axis) - warp.places(places - step * axis)) / (2.0 * step) for axis in np.eye(3)
    ]
    np.testing.assert_allclose(warp.derivatives(places), np.stack(differences, axis=2), atol=1e-6)


def test_three_or_flat_landmarks_give_the_similarity(rng):
    linear, offset = SIMILARITIES["turned"]
    for flat in (rng.normal(size=(3, 3)), rng.normal(size=(8, 3)) * [1.0, 1.0, 0.0]):
        warp = through_landmarks(flat, flat @ linear.T + offset)
        places = rng.normal(size=(20, 3))
        np.testing.assert_allclose(warp.places(places), places @ linear.T + offset, atol=1e-9)


@pytest.mark.parametrize(
    ("sources", "targets", "message"),
    [
        ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]], "three pairs"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 2, 0]], "not in line"),
        ([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 0, 0], [1, 0, 0]], "pairs"),
        ([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 2, 0]], np.eye(4, 3), "same place"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], np.eye(3), "non-finite"),
    ],
)
def test_landmarks_that_say_nothing_are_refused(sources, targets, message):
    with pytest.raises(HairError, match=message):
        through_landmarks(sources, targets)
