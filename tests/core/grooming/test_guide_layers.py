# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of guides restore recorded combing, keep lengths at any weight, and follow their guides."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import normals, positions
from hair_addon.core.geometry.strands import curve_offsets, from_numpy
from hair_addon.core.grooming import guide_layers, layer_transfer
from hair_addon.core.grooming.groom import GuideSettings, HairSettings, bind_hair, distribute_guides
from hair_addon.core.interpolation.regions import Regions

LENGTH = 2.0  # of guides, in radii of the sphere


def _lengths(points, counts):
    steps = np.linalg.norm(np.diff(points, axis=0, append=points[-1:]), axis=1)
    starts = curve_offsets(counts)
    return np.array([steps[start : end - 1].sum() for start, end in pairwise(starts)])


def _combed(points, counts, center, pull):
    """Move points near a center as a brush does; segments keep their lengths."""
    firsts = np.repeat(curve_offsets(counts)[:-1], counts)
    along = (np.arange(len(points)) - firsts) / np.repeat(np.maximum(counts - 1, 1), counts)
    away = np.linalg.norm(points - center, axis=1)
    target = points + (np.exp(-((away / 1.2) ** 2)) * along)[:, None] * pull
    before, steps = (np.diff(one, axis=0, prepend=one[:1]) for one in (points.astype(np.float64), target))
    sizes = np.linalg.norm(steps, axis=1)
    steps *= (np.linalg.norm(before, axis=1) / np.where(sizes > 0.0, sizes, 1.0))[:, None]
    sums = np.cumsum(steps, axis=0)
    return (points[firsts] + sums - sums[firsts]).astype(np.float32)


def _recorded(base, counts, its_normals, rng, layer_count=3):
    layers = guide_layers.without_layers(base, counts, its_normals)
    points = base
    for layer in range(layer_count):
        layers = guide_layers.added(layers)
        for _ in range(5):
            center = rng.normal(size=3) + np.array([0.0, 0.0, 1.5])
            points = _combed(points, counts, center, 0.8 * rng.normal(size=3))
        layers, _changed = guide_layers.recorded(layers, layer, points)
    return layers, points


def _grown(sphere, count, seed=1):
    settings = GuideSettings(guide_count=count, seed=seed, length=LENGTH, length_variation=0.0, tilt=0.0, gravity=0.0)
    return distribute_guides(sphere, settings)


@pytest.fixture(scope="module")
def combed(sphere):
    """Return (`GuideLayers`, points) of guides with three layers, and of guides of 41, 12 and 1 points."""
    rng = np.random.default_rng(5)
    guides = _grown(sphere, 60)
    counts = np.full(60, 41)
    counts[:20], counts[20] = 12, 1
    points = np.concatenate(
        [one[np.linspace(0, 40, n).astype(int)] for one, n in zip(guides.numpy(), counts, strict=True)]
    )
    return _recorded(points, counts, normals(sphere, guides.roots), rng)


def test_recording_and_composing_gives_the_edited_points(combed):
    layers, points = combed
    assert np.abs(points - layers.base).max() > 0.5
    np.testing.assert_allclose(guide_layers.composed(layers), points, atol=1e-6 * LENGTH)


@pytest.mark.parametrize("active", [0, 1, 2])
def test_any_layer_can_be_recorded_below_others(combed, active):
    layers, points = combed
    edited = _combed(points, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    again, is_changed = guide_layers.recorded(layers, active, edited)
    assert is_changed.any()
    np.testing.assert_allclose(guide_layers.composed(again), edited, atol=1e-6 * LENGTH)
    for other in {0, 1, 2} - {active}:
        assert np.array_equal(again.turns[other], layers.turns[other])
    is_same = np.repeat(~is_changed, layers.counts)
    assert np.array_equal(again.turns[:, is_same], layers.turns[:, is_same])


def _turns(axes_and_angles):
    """Return (..., 3, 3) matrices of rotation vectors (..., 3)."""
    angles = np.linalg.norm(axes_and_angles, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(axes_and_angles / np.where(angles[..., 0] > 0.0, angles[..., 0], 1.0), -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * cross @ cross


def _composed_in_double_precision(layers):
    """Return (N, 3): the formula of guide_layers.py, guide by guide."""
    sines = np.linalg.norm(layers.turns[..., 1:].astype(np.float64), axis=-1)
    angles = 2.0 * np.arctan2(sines, layers.turns[..., 0]) / np.where(sines > 0.0, sines, 1.0)
    found = layers.base.astype(np.float64)
    for guide, (first, end) in enumerate(pairwise(curve_offsets(layers.counts))):
        weights = layers.weights[:, guide].astype(np.float64)
        steps = np.diff(layers.base[first:end].astype(np.float64), axis=0)
        tangent, before = (axes[guide].astype(np.float64) for axes in (layers.tangents, layers.normals))
        for place, step in enumerate(steps, first + 1):
            length = np.linalg.norm(step)
            direction = step / length
            tangent = tangent - tangent @ direction / (1.0 + before @ direction) * (before + direction)
            frame = np.stack([tangent, np.cross(direction, tangent), direction], axis=1)
            for layer, weight in enumerate(weights):
                axis = layers.turns[layer, place, 1:].astype(np.float64)
                frame = frame @ _turns(weight * angles[layer, place] * axis)
            length *= np.exp(weights @ layers.stretches[:, place])
            found[place] = found[place - 1] + length * frame[:, 2]
            before = direction
    return found


@pytest.mark.parametrize("weights", [1.0, 0.4, 1.7, "mixed"])
def test_composing_follows_the_formula_to_a_millionth_of_the_length(combed, weights):
    layers, _points = combed
    rng = np.random.default_rng(3)
    stretches = (0.3 * rng.normal(size=layers.stretches.shape)).astype(np.float32)
    shares = rng.choice([0.0, 0.5, 1.0, 2.0], layers.weights.shape) if weights == "mixed" else weights
    layers = replace(layers, stretches=stretches).weighted(np.broadcast_to(shares, layers.weights.shape))
    expected = _composed_in_double_precision(layers)
    longest = _lengths(expected, layers.counts).max()
    np.testing.assert_allclose(guide_layers.composed(layers), expected, atol=1e-6 * longest)


def test_a_guide_is_the_same_bit_for_bit_beside_any_others(combed):
    layers, points = combed
    rng = np.random.default_rng(4)
    weights = rng.choice([0.0, 0.5, 1.0], layers.weights.shape)
    weights[:, 24:48] = 1.0  # blocks of guides with whole turns alone
    layers = layers.weighted(weights)
    edited = _combed(points, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    again, _changed = guide_layers.recorded(layers, 1, edited)
    chosen = rng.permutation(len(layers.counts))[:21]
    starts = curve_offsets(layers.counts)
    of_points = np.concatenate([np.arange(starts[guide], starts[guide + 1]) for guide in chosen])
    few = layer_transfer.chosen_guides(layers, chosen)
    assert np.array_equal(guide_layers.composed(few), guide_layers.composed(layers)[of_points])
    few_again, _changed = guide_layers.recorded(few, 1, edited[of_points])
    assert np.array_equal(few_again.turns, again.turns[:, of_points])
    assert np.array_equal(few_again.stretches, again.stretches[:, of_points])


def test_recording_with_the_known_shape_is_the_same(combed):
    layers, points = combed
    edited = _combed(points, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    firsts = curve_offsets(layers.counts)[:-1]
    shape = guide_layers.composed(layers)
    moved = slice(firsts[3], firsts[4])
    edited[moved] = shape[moved] + np.float32(0.25)  # a guide that is moved with its root
    again, is_changed = guide_layers.recorded(layers, 1, edited)
    same, is_same_changed = guide_layers.recorded(layers, 1, edited, shape)
    assert np.array_equal(is_changed, is_same_changed)
    for name in ("base", "turns", "stretches"):
        assert np.array_equal(getattr(again, name), getattr(same, name))
    is_other = guide_layers.is_other(layers, edited, shape)
    known, _changed = guide_layers.recorded(layers, 1, edited, shape, is_other)
    assert np.array_equal(known.turns, again.turns) and np.array_equal(known.base, again.base)
    full = guide_layers.composed(again)
    partly = guide_layers.composed_again(again, shape, is_other)
    assert 0 < is_other.sum() < len(is_other)
    assert np.array_equal(partly[np.repeat(is_other, layers.counts)], full[np.repeat(is_other, layers.counts)])
    assert np.array_equal(partly[~np.repeat(is_other, layers.counts)], shape[~np.repeat(is_other, layers.counts)])


def test_layers_may_be_in_separate_memory(combed):
    """Layers in separate arrays give the same bits; recording in place changes only the memory of its layer."""
    layers, points = combed
    edited = _combed(points, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    again, is_made = guide_layers.recorded(layers, 1, edited)
    turns, stretches = tuple(map(np.copy, layers.turns)), tuple(map(np.copy, layers.stretches))
    apart = replace(layers, turns=turns, stretches=stretches)
    assert np.array_equal(guide_layers.composed(apart), guide_layers.composed(layers))
    found, is_found = guide_layers.recorded(apart, 1, edited, in_place=True)
    assert found.turns[1] is turns[1] and np.array_equal(is_found, is_made)
    for layer in range(3):
        assert np.array_equal(turns[layer], again.turns[layer])
        assert np.array_equal(stretches[layer], again.stretches[layer])
    with pytest.raises(HairError):
        replace(layers, turns=(*turns[:2], turns[2][:-1]))


def test_invalid_numbers_of_layers_count_as_zero(combed):
    layers, points = combed
    turns, stretches = layers.turns.copy(), layers.stretches.copy()
    turns[0, 50:90, 1], turns[2, 300:340, 0], stretches[1, 500:510] = np.nan, np.inf, -np.inf
    invalid = replace(layers, turns=turns, stretches=stretches)
    valid = replace(
        layers,
        **{
            name: np.nan_to_num(getattr(invalid, name), nan=0.0, posinf=0.0, neginf=0.0)
            for name in ("turns", "stretches")
        },
    )
    assert np.array_equal(guide_layers.composed(invalid), guide_layers.composed(valid))
    edited = _combed(points, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    found, expected = (guide_layers.recorded(one, 1, edited)[0] for one in (invalid, valid))
    assert np.isfinite(found.turns[1]).all() and np.array_equal(found.turns[1], expected.turns[1])


@pytest.mark.parametrize("weight", [0.005, 0.02, 0.5, 1.0, 2.0])
def test_recording_knows_which_guides_its_layer_reproduces(combed, weight):
    """A layer reproduces guides if composing returns their points; small weights cannot turn far enough."""
    layers, _points = combed
    weights = np.array([1.0, weight, 0.7])[:, None] * np.ones_like(layers.weights)
    layers = layers.weighted(weights)
    shape = guide_layers.composed(layers)
    edited = _combed(shape, layers.counts, np.array([0.5, 0.0, 1.5]), np.array([0.0, 0.9, 0.3]))
    again, is_made = guide_layers.recorded(layers, 1, edited)
    is_edited = guide_layers.is_other(layers, edited, shape)
    is_missed = guide_layers.is_other(again, edited, guide_layers.composed(again))
    assert is_edited.any() and np.array_equal(is_made, is_edited & ~is_missed)
    assert is_made.any() == (weight > 0.01) and is_missed.any() == (weight < 0.5)


def test_guides_are_other_beyond_two_millionths_of_their_extent(combed):
    """Guides differ by more than rounding as a loop over guides finds; of some guides only these are compared."""
    layers, points = combed
    rng = np.random.default_rng(3)
    starts = curve_offsets(layers.counts)
    change = np.repeat(10.0 ** rng.uniform(-7.5, -4.5, len(layers.counts)), layers.counts)
    change *= np.repeat(rng.random(len(layers.counts)) < 0.7, layers.counts)
    edited = points + change.astype(np.float32)[:, None]
    edited[starts[3]] = np.nan
    expected = [
        not np.abs(edited[start:end] - points[start:end]).max() <= np.float32(2e-6) * np.abs(points[start:end]).max()
        for start, end in pairwise(starts)
    ]
    assert 0 < np.sum(expected) < len(expected)
    assert np.array_equal(guide_layers.is_other(layers, edited, points), expected)
    some = rng.random(len(expected)) < 0.5
    assert np.array_equal(guide_layers.is_other(layers, edited, points, some), expected & some)
    nothing = np.zeros(len(expected), bool)
    assert not guide_layers.is_other(layers, edited, points, nothing).any()


def test_zero_weights_are_the_base_bit_for_bit(combed):
    layers, _points = combed
    assert np.array_equal(guide_layers.composed(layers.weighted(np.zeros_like(layers.weights))), layers.base)


@pytest.mark.parametrize("weight", [0.3, 0.5, 1.7])
def test_any_weight_keeps_lengths(combed, weight):
    layers, _points = combed
    shape = guide_layers.composed(layers.weighted(np.full_like(layers.weights, weight)))
    np.testing.assert_allclose(_lengths(shape, layers.counts), _lengths(layers.base, layers.counts), rtol=1e-5)


def test_half_a_weight_is_half_the_turn_and_the_square_root_of_the_stretch():
    base = np.array([[0.0, 0.0, i] for i in range(5)], np.float32)
    layers = guide_layers.added(guide_layers.without_layers(base, np.array([5]), np.array([[0.0, 0.0, 1.0]])))
    edited = np.array([[4.0 * i, 0.0, 0.0] for i in range(5)], np.float32)
    layers, _changed = guide_layers.recorded(layers, 0, edited)
    half = guide_layers.composed(layers.weighted([[0.5]]))
    expected = 2.0 * np.arange(5)[:, None] * np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)])
    np.testing.assert_allclose(half, expected, atol=1e-5)


def test_a_layer_of_half_weight_can_be_recorded(combed):
    layers, _points = combed
    layers = layers.weighted(np.full_like(layers.weights, 0.5))
    edited = _combed(guide_layers.composed(layers), layers.counts, np.array([0.0, 0.0, 1.5]), np.array([0.9, 0.0, 0.0]))
    again, _changed = guide_layers.recorded(layers, 2, edited)
    np.testing.assert_allclose(guide_layers.composed(again), edited, atol=3e-6 * LENGTH)


def test_guides_without_weight_stay(combed):
    layers, _points = combed
    weights = layers.weights.copy()
    weights[1, ::2] = 0.0
    layers = layers.weighted(weights)
    before = guide_layers.composed(layers)
    edited = _combed(before, layers.counts, np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.5, 0.0]))
    again, is_changed = guide_layers.recorded(layers, 1, edited)
    assert not is_changed[::2].any() and is_changed[1::2].any()
    stays = np.repeat(np.arange(len(weights[0])) % 2 == 0, layers.counts)
    assert np.array_equal(guide_layers.composed(again)[stays], before[stays])


@pytest.mark.parametrize(
    "matrix",
    [
        pytest.param(100.0 * np.eye(3), id="scaled"),
        pytest.param(np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]]), id="turned"),
        pytest.param(np.diag([-1.0, 1.0, 1.0]), id="mirrored"),
    ],
)
def test_layers_follow_motions_scales_and_reflections(combed, matrix):
    layers, _points = combed
    size = abs(np.linalg.det(matrix)) ** (1 / 3)

    def move(points):
        return points @ matrix.T + size * np.array([0.3, -0.2, 0.1])

    followed = guide_layers.moved(layers, move)
    for weight in (1.0, 0.4):
        weights = np.full_like(layers.weights, weight)
        expected = move(guide_layers.composed(layers.weighted(weights)))
        np.testing.assert_allclose(guide_layers.composed(followed.weighted(weights)), expected, atol=2e-5 * size)


def test_layers_keep_their_shapes_under_uneven_scales(combed):
    layers, _points = combed
    scale = np.array([1.0, 3.0, 0.5])
    followed = guide_layers.moved(layers, lambda points: points * scale)
    for count in range(4):
        expected = guide_layers.composed(layers.up_to(count)) * scale
        np.testing.assert_allclose(guide_layers.composed(followed.up_to(count)), expected, atol=1e-5)


def test_merging_keeps_the_shape(combed):
    layers, _points = combed
    weights = layers.weights.copy()
    weights[1], weights[2] = 0.6, 0.7
    layers = layers.weighted(weights)
    merged = guide_layers.merged(layers, 0)
    assert len(merged.turns) == 2
    np.testing.assert_allclose(guide_layers.composed(merged), guide_layers.composed(layers), atol=1e-5)


def test_segments_of_no_length_have_finite_layers():
    base = np.zeros((5, 3), np.float32)
    base[3:, 2] = 1.0
    layers = guide_layers.added(guide_layers.without_layers(base, np.array([5]), np.zeros((1, 3))))
    edited = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]], np.float32)
    layers, _changed = guide_layers.recorded(layers, 0, edited)
    assert np.isfinite(layers.turns).all() and np.isfinite(layers.stretches).all()
    np.testing.assert_allclose(guide_layers.composed(layers), edited, atol=1e-5)


def test_arrays_that_do_not_fit_are_refused(combed):
    layers, points = combed
    with pytest.raises(HairError, match="weights"):
        layers.weighted(np.ones((2, 2)))
    with pytest.raises(HairError, match="edited points"):
        guide_layers.recorded(layers, 0, points[:-1])
    is_chosen = np.arange(len(layers.counts)) == 3
    with pytest.raises(HairError, match="composed points"):
        guide_layers.composed_again(layers, points[:-1], is_chosen)
    with pytest.raises(HairError, match="out of range"):
        guide_layers.composed_again(layers, points, np.append(is_chosen, True))


def _carried(sphere, layers, strands, others, settings=None, regions=()):
    """Return the layers of `strands` on other `Strands`, by the weights of hair between guides."""
    points = guide_layers.composed(layers).reshape(len(strands), -1, 3)
    guides = from_numpy(points, strands.roots)
    settings = settings or HairSettings(angle_limit=np.pi)
    binding = bind_hair(sphere, guides, settings, regions=regions, roots=others.roots)
    indices, weights = binding.guide_weights.indices.numpy(), binding.guide_weights.weights.numpy()
    places = positions(sphere, strands.roots)
    apart = np.linalg.norm(places[np.maximum(indices[:, 0], 0)] - positions(sphere, others.roots), axis=1)
    count = others.numpy().shape[1]
    base, counts = others.numpy().reshape(-1, 3), np.full(len(others), count)
    bare = guide_layers.without_layers(base, counts, normals(sphere, others.roots))
    return layer_transfer.transferred(layers, bare, indices, weights, apart / 2.0)


def test_layers_return_from_another_number_of_guides(sphere):
    """400, then 1,000, then 400 guides are off by 1 % of the length in the median, and guides that stay are exact."""
    few, many = _grown(sphere, 400), _grown(sphere, 1000, seed=2)
    counts = np.full(400, few.numpy().shape[1])
    its_normals = normals(sphere, few.roots)
    layers, points = _recorded(few.numpy().reshape(-1, 3), counts, its_normals, np.random.default_rng(1), 5)
    there = _carried(sphere, layers, few, many)
    back = _carried(sphere, there, many, few)
    apart = np.linalg.norm(guide_layers.composed(back) - points, axis=1).reshape(400, -1).max(axis=1) / LENGTH
    assert np.median(apart) <= 0.010
    both = from_numpy(np.concatenate([few.numpy(), many.numpy()]), few.roots.joined(many.roots))
    added = guide_layers.composed(_carried(sphere, layers, few, both))
    assert np.array_equal(added[: len(points)], guide_layers.composed(layers))


def test_layers_do_not_cross_a_parting(sphere):
    """Layers do not cross a parting: with one side combed up and the other down, no guide of another set is combed
    by both.
    """
    few, many = _grown(sphere, 60), _grown(sphere, 150, seed=2)
    sides = [np.where(positions(sphere, one.roots)[:, 0] > 0.0, 1.0, -1.0) for one in (few, many)]
    steps = np.linspace(0.0, LENGTH, few.numpy().shape[1])
    edited = few.numpy()[:, :1] + steps[None, :, None] * (sides[0][:, None] * [0.0, 0.0, 1.0])[:, None]
    counts = np.full(60, len(steps))
    base = few.numpy().reshape(-1, 3)
    layers = guide_layers.added(guide_layers.without_layers(base, counts, normals(sphere, few.roots)))
    layers, _changed = guide_layers.recorded(layers, 0, edited.reshape(-1, 3).astype(np.float32))
    corners = (sphere.vertices[:, 0] > 0.0).astype(np.int32)[sphere.triangles]
    regions = (Regions(corners, (sides[0] > 0.0).astype(np.int32)),)

    def rises(given):
        shape = guide_layers.composed(_carried(sphere, layers, few, many, regions=given)).reshape(150, -1, 3)
        return sides[1] * (shape[:, -1, 2] - shape[:, 0, 2])

    across = np.abs(positions(sphere, many.roots)[:, 0])
    near = (across > 0.15) & (across < 0.4)  # nearer, triangles are on both sides
    assert near.sum() > 5
    assert rises(regions)[near].min() > 0.3 * LENGTH
    assert rises(())[near].min() < 0.1 * LENGTH
