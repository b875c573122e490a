# SPDX-License-Identifier: GPL-3.0-or-later
"""Laws of interpolation: a weighted mean of turned offsets, as Eq. 7-10 say, whatever way it is computed."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from hair_addon.core import interpolation
from hair_addon.core.strands import offsets
from tests.devices import DEVICE


def vectors(array, device=DEVICE):
    return wp.array(np.float32(array), dtype=wp.vec3, device=device)


def unit(array):
    return array / np.linalg.norm(array, axis=-1, keepdims=True)


def strands_between(roots, normals, guides, guide_normals, distance, limit=8):
    """Points (S, P, 3) by both stages; guides (G, P, 3)."""
    roots, normals, guides, guide_normals = map(vectors, (roots, normals, guides, guide_normals))
    weights = interpolation.find_guides(roots, normals, guides[:, 0].contiguous(), guide_normals, distance, limit)
    return interpolation.interpolate(roots, normals, guides, guide_normals, weights).numpy()


def least_rotation(start, end):
    """The rotation about the axis across both that takes one unit vector to the other."""
    axis = np.cross(start, end)
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, np.dot(start, end))
    return Rotation.from_rotvec(axis * (angle / sine if sine > 0.0 else 0.0))


@pytest.fixture
def scene(rng):
    """Guides and roots scattered over a unit sphere: a dict of the arguments of `strands_between`."""
    guide_roots, roots = unit(rng.normal(size=(60, 3))), unit(rng.normal(size=(200, 3)))
    curls = np.cumsum(0.02 * rng.normal(size=(60, 20, 3)) + 0.05 * guide_roots[:, None], axis=1)
    guides = guide_roots[:, None] + np.concatenate([np.zeros((60, 1, 3)), curls], axis=1)
    guide_normals, normals = (
        unit(guide_roots + 0.1 * rng.normal(size=(60, 3))),
        unit(roots + 0.1 * rng.normal(size=(200, 3))),
    )
    return {"roots": roots, "normals": normals, "guides": guides, "guide_normals": guide_normals, "distance": 0.5}


def test_strands_are_what_the_equations_say(scene):
    """Eq. 7-10 read literally, recursion and all, with every guide looked at and rotations by scipy."""
    guides, distance = np.float32(scene["guides"]).astype(float), scene["distance"]
    expected = np.empty((200, 21, 3))
    for strand, (q, normal) in enumerate(zip(scene["roots"], scene["normals"], strict=True)):
        apart = np.linalg.norm(guides[:, 0] - q, axis=1)
        w = np.where(apart < distance, np.exp(-(apart**2) / (2.0 * (0.5 * distance) ** 2)), 0.0)  # Eq. 9
        w[np.argsort(apart)[8:]] = 0.0
        if not w.any():
            w[apart.argmin()] = 1.0
        turned = [
            least_rotation(n, normal).apply(o) for n, o in zip(scene["guide_normals"], offsets(guides), strict=True)
        ]
        expected[strand, 0] = q
        for i in range(1, 21):  # Eq. 10
            expected[strand, i] = expected[strand, i - 1] + np.einsum("j,jc->c", w, np.array(turned)[:, i]) / w.sum()
    np.testing.assert_allclose(strands_between(**scene), expected, atol=2e-5)


def test_weights_are_shares(scene):
    roots, normals, guide_normals = map(vectors, (scene["roots"], scene["normals"], scene["guide_normals"]))
    guide_roots = vectors(scene["guides"][:, 0])
    found = interpolation.find_guides(roots, normals, guide_roots, guide_normals, 0.4, 12)
    indices, weights = found.indices.numpy(), found.weights.numpy()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert np.all((weights > 0.0) == (indices >= 0))
    assert np.all(np.diff(weights, axis=1) <= 0.0)  # nearest first
    np.testing.assert_allclose(np.linalg.norm(found.turns.numpy(), axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize("distance", [1e-6, 0.05])
def test_a_root_without_a_guide_in_reach_follows_its_nearest(scene, distance):
    """Weights would be exp(-1e11) there: nothing may be divided by their rounded sum."""
    scene = scene | {"distance": distance}
    points = strands_between(**scene)
    apart = np.linalg.norm(scene["roots"][:, None] - scene["guides"][None, :, 0], axis=-1)
    alone = (apart < distance).sum(axis=1) <= 1
    assert alone.any()
    expected = [
        q + least_rotation(scene["guide_normals"][j], n).apply(scene["guides"][j] - scene["guides"][j, 0])
        for q, n, j in zip(scene["roots"], scene["normals"], apart.argmin(axis=1), strict=True)
    ]
    np.testing.assert_allclose(points[alone], np.array(expected)[alone], atol=1e-5)


def test_a_strand_at_a_guides_root_is_the_guide(scene):
    points = strands_between(
        scene["guides"][:, 0], scene["guide_normals"], scene["guides"], scene["guide_normals"], 0.5, limit=1
    )
    np.testing.assert_allclose(points, scene["guides"], atol=1e-6)


def test_rigid_motion_of_all_moves_the_strands(scene, rng):
    rotation, shift = Rotation.random(rng=rng), rng.normal(size=3)
    moved = {name: rotation.apply(a.reshape(-1, 3)).reshape(a.shape) for name, a in scene.items() if name != "distance"}
    moved["roots"], moved["guides"] = moved["roots"] + shift, moved["guides"] + shift
    expected = rotation.apply(strands_between(**scene).reshape(-1, 3)).reshape(200, -1, 3) + shift
    np.testing.assert_allclose(strands_between(**moved, distance=0.5), expected, atol=1e-5)


def test_mirrored_input_gives_mirrored_strands(scene):
    mirror = np.array([-1.0, 1.0, 1.0])
    mirrored = {name: a * mirror for name, a in scene.items() if name != "distance"}
    np.testing.assert_allclose(strands_between(**mirrored, distance=0.5), strands_between(**scene) * mirror, atol=1e-5)


def test_strands_stay_within_the_hull_of_their_guides(scene, rng):
    """On flat ground, where nothing turns: in no direction does a strand reach farther than some guide."""
    up = np.array([0.0, 0.0, 1.0])
    flat = scene | {"normals": np.tile(up, (200, 1)), "guide_normals": np.tile(up, (60, 1))}
    shapes = strands_between(**flat) - scene["roots"][:, None]
    guide_shapes = scene["guides"] - scene["guides"][:, :1]
    directions = unit(rng.normal(size=(50, 3)))
    assert np.all((shapes @ directions.T).max(axis=0) <= (guide_shapes @ directions.T).max(axis=0) + 1e-5)


def test_the_order_of_strands_does_not_matter(scene, rng):
    order = rng.permutation(200)
    shuffled = scene | {"roots": scene["roots"][order], "normals": scene["normals"][order]}
    np.testing.assert_array_equal(strands_between(**shuffled), strands_between(**scene)[order])


def test_the_order_of_guides_does_not_matter(scene, rng):
    order = rng.permutation(60)
    shuffled = scene | {"guides": scene["guides"][order], "guide_normals": scene["guide_normals"][order]}
    np.testing.assert_allclose(strands_between(**shuffled), strands_between(**scene), atol=1e-6)


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.5])
def test_turning_normals_turn_strands_without_a_jump(tilt):
    """All around and over the poles, where any choice of tangents must jump somewhere."""
    angle = np.linspace(0.0, 2.0 * np.pi, 2000)
    normals = np.stack([np.sin(angle), np.zeros(2000), np.cos(angle)], axis=1)
    normals = Rotation.from_rotvec([tilt, 0.3 * tilt, 0.0]).apply(normals)
    guide = np.linspace(0.0, 1.0, 5)[None, :, None] * np.array([0.4, 0.5, 0.3])
    guide_normal = unit(np.array([[0.1, 0.9, -0.2]]))
    points = strands_between(np.zeros((2000, 3)), normals, guide, guide_normal, 1.0)
    steps = np.linalg.norm(np.diff(points[:, -1], axis=0), axis=1)
    assert steps[normals[1:] @ guide_normal[0] > -0.9].max() < 0.01  # opposite the guide there is no least rotation


def test_opposite_normals_keep_the_length():
    """There is no least rotation to the other side; any rotation will do, nothing else will."""
    guide = np.linspace(0.0, 1.0, 5)[None, :, None] * np.array([0.4, 0.5, 0.3])
    for nudge in (0.0, 1e-7, 1e-4, 1e-3):
        normals = unit(np.array([[nudge, 0.0, -1.0], [0.0, 1.0, nudge]]))
        points = strands_between(np.zeros((2, 3)), normals, guide, [(0.0, 0.0, 1.0)], 1.0)
        np.testing.assert_allclose(np.linalg.norm(points[:, -1], axis=1), np.linalg.norm(guide[0, -1]), rtol=1e-5)
        np.testing.assert_allclose(points[0, -1] @ normals[0], 0.3, atol=1e-3)


@pytest.mark.parametrize("point_count", [1, 2, 15, 16, 17, 41, 64])
def test_any_number_of_points(scene, point_count):
    """A strand's points do not depend on how many follow."""
    guides = np.concatenate([scene["guides"]] * 4, axis=1)[:, :point_count]
    expected = strands_between(**scene)[:, :21]
    count = min(point_count, 21)
    np.testing.assert_allclose(strands_between(**scene | {"guides": guides})[:, :count], expected[:, :count], atol=1e-6)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_automatic_influence_is_twice_the_spacing(scale):
    grid = scale * np.stack([*np.indices((9, 7)), np.zeros((9, 7))], axis=-1).reshape(-1, 3)
    assert interpolation.automatic_influence_distance(vectors(grid)) == pytest.approx(2.0 * scale, rel=1e-4)


def test_a_lone_guide_has_an_influence():
    assert interpolation.automatic_influence_distance(vectors([(3.0, 4.0, 5.0)])) > 0.0
    assert interpolation.automatic_influence_distance(vectors([(3.0, 4.0, 5.0)] * 3)) > 0.0


@pytest.mark.parametrize("point_count", [1, 3, 4, 5, 41])
def test_both_ways_are_one(scene, point_count):
    """The processor's way and the GPU's, each on any device, round alike: the same sums in the same order."""
    guides = np.concatenate([scene["guides"]] * 2, axis=1)[:, :point_count]
    roots, normals, guides, guide_normals = map(
        vectors, (scene["roots"], scene["normals"], guides, scene["guide_normals"])
    )
    guide_roots = guides[:, 0].contiguous()
    weights = interpolation.find_guides(roots, normals, guide_roots, guide_normals, scene["distance"], 8)
    one, other = (
        way(roots, normals, guides, guide_normals, weights).numpy()
        for way in (interpolation.by_strands, interpolation.by_points)
    )
    np.testing.assert_array_equal(one, other)
