# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolated strands are weighted means of rotated offsets with the guides' lengths, in all implementations."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from hair_addon.core.geometry.strands import offsets, segment_lengths
from hair_addon.core.interpolation import interpolation
from hair_addon.core.interpolation.hair_binding import SPREAD
from hair_addon.core.interpolation.sharp_edges import BEGIN, END, HOLD
from tests.support.devices import DEVICE
from tests.support.strands.finding import find_guides, strands_between

BEGIN_COSINE, END_COSINE = np.cos(BEGIN), np.cos(END)


def vectors(array, device=DEVICE):
    return wp.array(np.float32(array), dtype=wp.vec3, device=device)


def unit(array):
    return array / np.linalg.norm(array, axis=-1, keepdims=True)


def least_rotations(starts, end):
    """Return matrices (N, 3, 3) of the least rotations that take unit vectors (N, 3) to others."""
    axes = np.cross(starts, end)
    sines = np.linalg.norm(axes, axis=1)
    angles = np.arctan2(sines, starts @ end)
    return Rotation.from_rotvec(axes * (angles / np.where(sines > 0.0, sines, 1.0))[:, None]).as_matrix()


def limited_turn(root, normal, w, guides, guide_normals):
    """Return the matrix (3, 3) that takes a strand's normal toward the mean normal of its guides."""
    most = SPREAD * (w @ np.linalg.norm(guides[:, 0] - root, axis=1)) / (w @ segment_lengths(guides).sum(axis=1))
    step = unit(w @ guide_normals) - normal
    apart = np.linalg.norm(step)
    past = np.clip(2.0 * apart - 1.0, 0.0, 1.0)
    part = max(1.0 - most / apart, 0.0) * (1.0 - past**2 * (3.0 - 2.0 * past))
    return least_rotations(normal[None], unit(normal + part * step))[0]


@pytest.fixture
def scene(rng):
    """Return a dict of the arguments of `strands_between`, with guides and roots scattered over a unit sphere."""
    guide_roots, roots = unit(rng.normal(size=(60, 3))), unit(rng.normal(size=(200, 3)))
    curls = np.cumsum(0.02 * rng.normal(size=(60, 20, 3)) + 0.05 * guide_roots[:, None], axis=1)
    guides = guide_roots[:, None] + np.concatenate([np.zeros((60, 1, 3)), curls], axis=1)
    guide_normals, normals = (
        unit(guide_roots + 0.1 * rng.normal(size=(60, 3))),
        unit(roots + 0.1 * rng.normal(size=(200, 3))),
    )
    return {"roots": roots, "normals": normals, "guides": guides, "guide_normals": guide_normals}


def weights_of(roots, guide_roots, distance, limit, facing=1.0):
    """Return (S, G) weights by the formula of guide_weights.py over all guides, in double precision.

    facing: (S, G) cosines between the normals of strands and guides.
    """
    apart = np.linalg.norm(np.float32(roots)[:, None].astype(float) - np.float32(guide_roots)[None], axis=-1)
    left_out = np.sort(apart, axis=1)[:, limit] if limit < len(guide_roots) else np.full(len(roots), np.inf)
    other_face = np.clip((BEGIN_COSINE - facing) / (BEGIN_COSINE - END_COSINE), 0.0, 1.0)
    other_face = HOLD * other_face**2 * (3.0 - 2.0 * other_face)
    apart = apart + other_face * np.maximum(np.minimum(left_out, apart.max(axis=1))[:, None] - apart, 0.0)
    ordered = np.sort(apart, axis=1)
    if distance is None:
        distance = np.where(np.isfinite(left_out), left_out, 1.25 * ordered[:, -1])
    distance = np.maximum(distance, 1.25 * ordered[:, 0])[:, None]
    reach = np.minimum(distance, left_out[:, None])
    w = np.exp(-(apart**2) / (2.0 * (0.5 * distance) ** 2)) * np.maximum(1.0 - (apart / reach) ** 2, 0.0) ** 2  # Eq. 9
    return w / w.sum(axis=1, keepdims=True)


@pytest.mark.parametrize("distance", [None, 0.5, 0.2])
@pytest.mark.parametrize("keep_length", [0.0, 0.4, 1.0])
def test_strands_are_what_the_equations_say(scene, distance, keep_length):
    """Strands equal a literal computation of Eq. 7-10, with recursion, all guides, and rotations by scipy."""
    guides = np.float32(scene["guides"]).astype(float)
    weights = weights_of(scene["roots"], guides[:, 0], distance, 8, scene["normals"] @ scene["guide_normals"].T)
    guide_offsets, guide_lengths = offsets(guides), np.pad(segment_lengths(guides), [(0, 0), (1, 0)])
    expected = np.empty((200, 21, 3))
    for strand, (q, normal, w) in enumerate(zip(scene["roots"], scene["normals"], weights, strict=True)):
        turned = np.einsum("jab,jib->jia", least_rotations(scene["guide_normals"], normal), guide_offsets)
        turned = turned @ limited_turn(q, normal, w, guides, scene["guide_normals"]).T
        expected[strand, 0] = q
        for i in range(1, 21):  # Eq. 10
            mean = w @ turned[:, i]
            stretch = (w @ guide_lengths[:, i]) / np.linalg.norm(mean)
            expected[strand, i] = expected[strand, i - 1] + (1.0 + keep_length * (stretch - 1.0)) * mean
    strands = strands_between(**scene, distance=distance, keep_length=keep_length)
    np.testing.assert_allclose(strands, expected, atol=5e-5)


def test_segments_are_as_long_as_the_guides_are_on_average(scene):
    """Segments are as long as the guides' on average, however much guides disagree."""
    facing = scene["normals"] @ scene["guide_normals"].T
    weights = weights_of(scene["roots"], scene["guides"][:, 0], 0.5, 8, facing)
    wanted = weights @ segment_lengths(scene["guides"])
    kept = segment_lengths(strands_between(**scene, distance=0.5))
    np.testing.assert_allclose(kept, wanted, rtol=2e-3)
    shrunk = segment_lengths(strands_between(**scene, distance=0.5, keep_length=0.0))
    assert (shrunk / wanted).min() < 0.5 and np.all(shrunk <= wanted * (1.0 + 1e-4))


@pytest.mark.parametrize("distance", [None, 0.2])
def test_strands_change_without_a_step(rng, distance):
    """Strands change without a step: their points move less with finer steps of roots past random guides."""
    up = np.array([0.0, 0.0, 1.0])
    roots = np.pad(rng.random((150, 2)), [(0, 0), (0, 1)])
    curls = np.cumsum(0.03 * rng.normal(size=(150, 20, 3)) + 0.05 * up, axis=1)
    guides = roots[:, None] + np.pad(curls, [(0, 0), (1, 0), (0, 0)])
    along = np.linspace(0.1, 0.9, 20_001)
    path = np.stack([along, 0.5 + 0.3 * np.sin(7.0 * along), 0.0 * along], axis=1)
    strands = strands_between(path, np.tile(up, (20_001, 1)), guides, np.tile(up, (150, 1)), distance)
    steepest = {}
    for every in (1, 10):
        moved = np.linalg.norm(np.diff(strands[::every], axis=0), axis=-1).max(axis=1)
        steepest[every] = (moved / np.linalg.norm(np.diff(path[::every], axis=0), axis=1)).max()
    assert steepest[1] < 40.0 and steepest[1] < 1.5 * steepest[10]


def test_guides_that_cancel_make_no_noise():
    """Opposite guides cancel without noise: the strand stays at its root and does not grow along rounding errors."""
    guides = np.stack([np.linspace(0.0, 1.0, 9)[:, None] * np.array([side, 0.0, 0.0]) for side in (1.0, -1.0)])
    points = strands_between([(0.0, 0.5, 0.0)], [(0, 0, 1)], guides, [(0, 0, 1), (0, 0, 1)])
    np.testing.assert_allclose(points[0] - [0.0, 0.5, 0.0], np.zeros((9, 3)), atol=1e-3)


def test_a_strand_at_a_guides_root_is_the_guide(scene):
    points = strands_between(
        scene["guides"][:, 0], scene["guide_normals"], scene["guides"], scene["guide_normals"], 0.5, limit=1
    )
    np.testing.assert_allclose(points, scene["guides"], atol=1e-6)


def test_rigid_motion_of_all_moves_the_strands(scene, rng):
    rotation, shift = Rotation.random(rng=rng), rng.normal(size=3)
    moved = {name: rotation.apply(a.reshape(-1, 3)).reshape(a.shape) for name, a in scene.items()}
    moved["roots"], moved["guides"] = moved["roots"] + shift, moved["guides"] + shift
    expected = rotation.apply(strands_between(**scene).reshape(-1, 3)).reshape(200, -1, 3) + shift
    np.testing.assert_allclose(strands_between(**moved), expected, atol=1e-5)


def test_mirrored_input_gives_mirrored_strands(scene):
    mirror = np.array([-1.0, 1.0, 1.0])
    mirrored = {name: a * mirror for name, a in scene.items()}
    np.testing.assert_allclose(strands_between(**mirrored), strands_between(**scene) * mirror, atol=1e-5)


def test_strands_stay_within_the_hull_of_their_guides(scene, rng):
    """On flat ground, strands stay within the hull of their guides in every direction (Eq. 10)."""
    up = np.array([0.0, 0.0, 1.0])
    flat = scene | {"normals": np.tile(up, (200, 1)), "guide_normals": np.tile(up, (60, 1))}
    shapes = strands_between(**flat, keep_length=0.0) - scene["roots"][:, None]
    guide_shapes = scene["guides"] - scene["guides"][:, :1]
    directions = unit(rng.normal(size=(50, 3)))
    assert np.all((shapes @ directions.T).max(axis=0) <= (guide_shapes @ directions.T).max(axis=0) + 1e-5)


@pytest.mark.parametrize("length", [0.4, 0.01])
def test_long_hair_does_not_spread_beyond_its_guides(rng, length):
    """Beyond the outermost guides, strands move away from hanging guides by a quarter of the distance of the guides.

    Strands as short as this distance turn with the surface. Rotations to the mean of normals cancel in first order.
    """
    directions = unit(rng.normal(size=(900, 3)))
    is_guide = directions[:, 0] < -0.3
    guide_normals, normals = directions[is_guide], directions[~is_guide]
    hanging = np.linspace(0.0, length, 9)[:, None] * [0.0, 0.0, -1.0]
    guides, roots = 0.1 * guide_normals[:, None] + hanging, 0.1 * normals
    weights = weights_of(roots, guides[:, 0], None, 8)
    chords = np.linalg.norm(unit(weights @ guide_normals) - normals, axis=1)
    is_beside = chords < 0.45
    strands = strands_between(roots, normals, guides, guide_normals) - roots[:, None]
    grown = np.linalg.norm(strands[:, -1] - hanging[-1], axis=1)
    distance = (weights * np.linalg.norm(roots[:, None] - guides[:, 0], axis=2)).sum(axis=1)
    least = np.minimum(chords, SPREAD * distance / length) * length
    assert np.all(grown[is_beside] <= least[is_beside] + 0.02 * length)
    assert np.mean((least < 0.5 * chords * length)[is_beside]) == pytest.approx(float(length > 0.1), abs=0.2)


@pytest.mark.parametrize("edge", [15.0, 28.0])
def test_parallel_hair_stays_parallel_across_a_sharp_edge(rng, edge):
    """At sharp edges of less than 29°, long hair moves aside by at most a quarter of the distance of its guides."""
    turn, length = np.radians(edge), 0.3
    places = rng.uniform(-0.1, 0.1, (900, 2))
    is_wall, is_guide = places[:, 0] > 0.0, rng.random(900) < 0.15
    height = np.where(is_wall, -np.sin(turn) * places[:, 0], 0.0)
    roots = np.stack([np.where(is_wall, np.cos(turn), 1.0) * places[:, 0], places[:, 1], height], axis=1)
    normals = np.where(is_wall[:, None], (np.sin(turn), 0.0, np.cos(turn)), (0.0, 0.0, 1.0))
    hanging = np.linspace(0.0, length, 9)[:, None] * unit(np.array([1.0, 0.2, 0.3]))
    guides = roots[is_guide][:, None] + hanging
    roots, normals, guide_normals = roots[~is_guide], normals[~is_guide], normals[is_guide]
    strands = strands_between(roots, normals, guides, guide_normals) - roots[:, None]
    moved = np.linalg.norm(strands[:, -1] - hanging[-1], axis=1)
    weights = weights_of(roots, guides[:, 0], None, 8)
    distance = (weights * np.linalg.norm(roots[:, None] - guides[:, 0], axis=2)).sum(axis=1)
    assert np.all(moved <= SPREAD * distance + 0.01 * length) and moved.max() > 0.1 * SPREAD * distance.max()


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
    """Turning normals turn strands without a jump, all around and over the poles, where any choice of tangents
    jumps.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 2000)
    normals = np.stack([np.sin(angle), np.zeros(2000), np.cos(angle)], axis=1)
    normals = Rotation.from_rotvec([tilt, 0.3 * tilt, 0.0]).apply(normals)
    guide = np.linspace(0.0, 1.0, 5)[None, :, None] * np.array([0.4, 0.5, 0.3])
    guide_normal = unit(np.array([[0.1, 0.9, -0.2]]))
    points = strands_between(np.zeros((2000, 3)), normals, guide, guide_normal, 1.0)
    steps = np.linalg.norm(np.diff(points[:, -1], axis=0), axis=1)
    assert steps[normals[1:] @ guide_normal[0] > -0.9].max() < 0.01  # opposite the guide there is no least rotation


def test_opposite_normals_keep_the_length():
    """Strands between opposite normals keep the length, by any of the rotations to the other side."""
    guide = np.linspace(0.0, 1.0, 5)[None, :, None] * np.array([0.4, 0.5, 0.3])
    for nudge in (0.0, 1e-7, 1e-4, 1e-3):
        normals = unit(np.array([[nudge, 0.0, -1.0], [0.0, 1.0, nudge]]))
        points = strands_between(np.zeros((2, 3)), normals, guide, [(0.0, 0.0, 1.0)], 1.0)
        np.testing.assert_allclose(np.linalg.norm(points[:, -1], axis=1), np.linalg.norm(guide[0, -1]), rtol=1e-5)
        np.testing.assert_allclose(points[0, -1] @ normals[0], 0.3, atol=1e-3)


@pytest.mark.parametrize("point_count", [1, 2, 9, 41])
def test_strands_of_gathered_guides_reach_the_mean_of_their_guides_at_the_tie(scene, point_count):
    """Strands move from their own places to the means of guides' points; other strands keep the same bits."""
    guides = np.concatenate([scene["guides"]] * 2, axis=1)[:, :point_count]
    arrays = scene["roots"], scene["normals"], guides, scene["guide_normals"]
    roots, normals, points, guide_normals = (vectors(array) for array in arrays)
    weights = find_guides(roots, normals, points[:, 0].contiguous(), guide_normals, None, 8)
    free = interpolation.interpolate(roots, normals, points, guide_normals, weights).numpy()
    tie_fractions = np.random.default_rng(5).uniform(0.05, 1.0, len(guides)).astype(np.float32)
    tie_fractions[::3] = 0.0
    of_guides = wp.array(tie_fractions, dtype=float, device=DEVICE)
    found = interpolation.interpolate(roots, normals, points, guide_normals, weights, tie_fractions=of_guides).numpy()
    indices, shares = weights.indices.numpy(), weights.weights.numpy().astype(np.float64)
    shares[indices < 0] = 0.0
    along = np.arange(point_count)[None] / np.maximum(tie_fractions[:, None] * (point_count - 1), 1e-9)
    along = np.where(tie_fractions[:, None] > 0.0, np.minimum(along, 1.0), 0.0)
    part = np.einsum("sk,skp->sp", shares, (along * along * (3.0 - 2.0 * along))[indices])[..., None]
    means = np.einsum("sk,skpi->spi", shares, guides.astype(np.float64)[indices])
    np.testing.assert_allclose(found, free + part * (means - free), atol=2e-5 * np.abs(guides).max())
    is_untied = (np.where(shares > 0.0, tie_fractions[indices], 0.0) == 0.0).all(axis=1)
    np.testing.assert_array_equal(found[is_untied], free[is_untied])


@pytest.mark.parametrize("point_count", [1, 2, 6, 7, 40, 41, 42, 81])
def test_any_number_of_points(scene, point_count):
    """A strand's points do not depend on how many follow, while strands are short beside the distance of guides."""
    roots = scene["guides"][:, :1]
    scene["guides"] = roots + 0.002 * (scene["guides"] - roots)
    guides = np.concatenate([scene["guides"]] * 4, axis=1)[:, :point_count]
    expected = strands_between(**scene)[:, :21]
    count = min(point_count, 21)
    np.testing.assert_allclose(strands_between(**scene | {"guides": guides})[:, :count], expected[:, :count], atol=1e-6)


@pytest.mark.skipif(DEVICE == "cpu", reason="needs VELLUS_TEST_DEVICE")
@pytest.mark.parametrize("point_count", [1, 3, 6, 40, 41, 42, 81, 100])
@pytest.mark.parametrize("strand_count", [1, 4, 7, 16, 41])
@pytest.mark.parametrize("limit", [1, 8, 20])
def test_both_ways_are_one(scene, point_count, strand_count, limit):
    """The processor's and the GPU's implementations give the same strands, up to the order of sums."""
    guides = np.concatenate([scene["guides"]] * 5, axis=1)[:, :point_count]
    arrays = scene["roots"][:strand_count], scene["normals"][:strand_count], guides, scene["guide_normals"]

    def strands_on(device):
        roots, normals, guides, guide_normals = (vectors(array).to(device) for array in arrays)
        weights = find_guides(roots, normals, guides[:, 0].contiguous(), guide_normals, None, limit)
        return interpolation.interpolate(roots, normals, guides, guide_normals, weights).numpy()

    np.testing.assert_allclose(strands_on("cpu"), strands_on(DEVICE), atol=1e-5)


@pytest.mark.parametrize("point_count", [20, 41, 60])
def test_strands_fill_rows_of_a_larger_array(scene, point_count):
    """Strands fill rows of a larger array, at any position in memory and nowhere else."""
    guides = np.concatenate([scene["guides"]] * 3, axis=1)[:, :point_count]
    expected = strands_between(**scene | {"guides": guides})
    roots, normals, guides, guide_normals = (
        vectors(array) for array in (scene["roots"], scene["normals"], guides, scene["guide_normals"])
    )
    weights = find_guides(roots, normals, guides[:, 0].contiguous(), guide_normals, None, 8)
    for before in (0, 1, 3):
        rows = wp.full((210, point_count), wp.vec3(7.0), dtype=wp.vec3, device=DEVICE)
        interpolation.interpolate(roots, normals, guides, guide_normals, weights, 1.0, rows[before : before + 200])
        np.testing.assert_array_equal(rows.numpy()[before : before + 200], expected)
        assert np.all(rows.numpy()[:before] == 7.0) and np.all(rows.numpy()[before + 200 :] == 7.0)
