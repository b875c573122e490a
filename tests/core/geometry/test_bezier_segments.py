# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubic bases, Hermite curves and NURBS equal SciPy's as Bézier segments, and polylines follow their curves."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicHermiteSpline

from hair_addon.core.geometry.curves import bezier_segments
from hair_addon.core.geometry.strands import curve_offsets

CUBIC = [(basis, wrap) for basis in bezier_segments.BASES for wrap in ("nonperiodic", "pinned", "periodic")]
COUNTS = {"bezier": {"periodic": [6, 3, 9]}, "bspline": {"pinned": [2, 3, 8]}, "catmullRom": {"pinned": [2, 3, 8]}}


def counts_of(basis, wrap):
    return np.array(COUNTS[basis].get(wrap, [4, 7, 10]))


def wandering(rng, count):
    """Return points that progress as those of hair do."""
    return np.cumsum(rng.normal(size=(count, 3)) * 0.02 + [0.0, 0.0, 0.03], axis=0)


def at(segments, parts):
    """Return (K, T, D) values of segments by de Casteljau's construction."""
    part = np.asarray(parts)[None, :, None]
    weights = segments.weights if segments.weights is not None else np.ones(segments.controls.shape[:2])
    level = np.dstack([segments.controls * weights[..., None], weights])[:, None] + np.zeros((1, len(parts), 1, 1))
    while level.shape[2] > 1:
        level = (1.0 - part[..., None]) * level[:, :, :-1] + part[..., None] * level[:, :, 1:]
    return level[:, :, 0, :-1] / level[:, :, 0, -1:]


def expected(points, basis, wrap, parts):
    """Return (K, T, 3) values of one cubic curve by its definition."""
    n = len(points)
    if basis == "bezier":
        count = n // 3 if wrap == "periodic" else (n - 4) // 3 + 1
        near = np.stack([points[(3 * k + np.arange(4)) % n] for k in range(count)])
        t = np.asarray(parts)[:, None]
        terms = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
        return sum(term * near[:, None, i] for i, term in enumerate(terms))
    if wrap == "periodic":
        near = np.concatenate([points, points, points, points])[: n + 3]
    elif wrap == "pinned":
        near = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    else:
        near = points
    count = len(near) - 3
    if basis == "bspline":
        spline = BSpline(np.arange(len(near) + 4.0) - 3.0, near, 3)
        return np.stack([spline(k + np.asarray(parts)) for k in range(count)])
    tangents = (near[2:] - near[:-2]) / 2.0
    return np.stack(
        [CubicHermiteSpline([0, 1], near[k + 1 : k + 3], tangents[k : k + 2])(np.asarray(parts)) for k in range(count)]
    )


@pytest.mark.parametrize(("basis", "wrap"), CUBIC)
def test_cubic_curves_are_those_of_their_definitions(rng, basis, wrap):
    counts = counts_of(basis, wrap)
    points, parts = wandering(rng, counts.sum()), np.linspace(0.0, 1.0, 7)
    segments = bezier_segments.cubic(points, counts, basis, wrap)
    assert bezier_segments.is_cubic(counts, basis, wrap).all()
    np.testing.assert_array_equal(segments.counts, bezier_segments.segment_counts(counts, basis, wrap))
    starts = curve_offsets(counts)
    wanted = np.concatenate([expected(points[a:b], basis, wrap, parts) for a, b in pairwise(starts)])
    np.testing.assert_allclose(at(segments, parts), wanted, atol=1e-14)
    if wrap == "pinned" or basis == "bezier":
        ends = curve_offsets(segments.counts)
        np.testing.assert_array_equal(segments.controls[ends[:-1], 0].round(14), points[starts[:-1]].round(14))
        if wrap != "periodic":
            np.testing.assert_allclose(segments.controls[ends[1:] - 1, -1], points[starts[1:] - 1], atol=1e-15)


@pytest.mark.parametrize(("basis", "wrap"), CUBIC)
def test_points_of_any_sum_of_ones_and_in_any_axes_are_the_same(rng, basis, wrap):
    counts = counts_of(basis, wrap)
    points, turn, shift = wandering(rng, counts.sum()), rng.normal(size=(3, 3)), rng.normal(size=3)
    ones = bezier_segments.cubic(np.ones((len(points), 1)), counts, basis, wrap)
    np.testing.assert_allclose(ones.controls, 1.0, atol=1e-15)
    there = bezier_segments.cubic(points @ turn.T + shift, counts, basis, wrap).controls
    here = bezier_segments.cubic(points, counts, basis, wrap).controls
    np.testing.assert_allclose(there, here @ turn.T + shift, atol=1e-14)


def test_hermite_curves_are_those_of_scipy(rng):
    counts = np.array([2, 5, 3])
    points, tangents, parts = wandering(rng, 10), rng.normal(size=(10, 3)) * 0.03, np.linspace(0.0, 1.0, 5)
    found = at(bezier_segments.hermite(points, tangents, counts), parts)
    wanted = [
        CubicHermiteSpline(np.arange(b - a), points[a:b], tangents[a:b])(k + parts)
        for a, b in ((0, 2), (2, 7), (7, 10))
        for k in range(b - a - 1)
    ]
    np.testing.assert_allclose(found, wanted, atol=1e-14)


def nurbs_of(rng):
    """Return curves of several orders, with repeated knots and weights."""
    counts, orders = np.array([4, 7, 3, 2, 9]), np.array([4, 3, 3, 2, 6])
    knots = []
    for count, order in zip(counts, orders, strict=True):
        inside = np.sort(rng.random(count - order))
        if len(inside) > 2:
            inside[1] = inside[0]  # a span of no length
        knots.append(np.concatenate([np.zeros(order), inside, np.ones(order)]))
    knots[1] = np.arange(counts[1] + orders[1]) / 10.0  # not held at its ends
    return counts, orders, knots, wandering(rng, counts.sum()), rng.uniform(0.3, 3.0, counts.sum())


@pytest.mark.parametrize("is_rational", [False, True])
def test_nurbs_are_those_of_scipy_within_their_ranges(rng, is_rational):
    counts, orders, knots, points, weights = nurbs_of(rng)
    ranges = np.array([[0.25, 0.75], [0.0, 9.0], [0.0, 1.0], [0.1, 1.0], [0.0, 0.5]])
    weights = weights if is_rational else None
    segments = bezier_segments.nurbs(points, weights, counts, orders, np.concatenate(knots), ranges)
    parts, starts, ends = np.linspace(0.0, 1.0, 9), curve_offsets(counts), curve_offsets(segments.counts)
    found = at(segments, parts)
    for curve, order in enumerate(orders):
        its = slice(starts[curve], starts[curve + 1])
        w = np.ones((counts[curve], 1)) if weights is None else weights[its][:, None]
        low = max(ranges[curve, 0], knots[curve][order - 1])
        high = min(ranges[curve, 1], knots[curve][counts[curve]])
        inside = [k for k in np.unique(knots[curve]) if low < k < high]
        spline = BSpline(knots[curve], np.hstack([points[its] * w, w]), order - 1)
        spans = np.array([low, *inside, high])
        assert segments.counts[curve] == len(spans) - 1
        for number, (a, b) in enumerate(pairwise(spans)):
            # Just inside: at knots that repeat as often as the degree a curve may jump.
            value = spline(np.clip(a + (b - a) * parts, a + 1e-13, b - 1e-13))
            np.testing.assert_allclose(found[ends[curve] + number], value[:, :3] / value[:, 3:], atol=1e-9)


def test_a_circle_of_nurbs_is_a_circle():
    corners = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
    weights = np.where(np.arange(9) % 2, np.sqrt(0.5), 1.0)
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], float)
    points = np.column_stack([corners, np.zeros(9)])
    segments = bezier_segments.nurbs(points, weights, np.array([9]), np.array([3]), knots, None)
    values, counts, _places = bezier_segments.polylines(segments, bezier_segments.line_counts(segments))
    np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-15)
    length = np.linalg.norm(np.diff(values, axis=0), axis=1).sum()
    assert counts.tolist() == [len(values)] and length == pytest.approx(2.0 * np.pi, rel=1e-3)


@pytest.mark.parametrize("basis", list(bezier_segments.BASES))
def test_polylines_are_as_long_as_their_curves_and_as_near(rng, basis):
    counts = np.array([4, 13, 16])
    points = wandering(rng, counts.sum())
    along = 1.5 * np.arange(16)
    points[-16:] = np.stack([np.cos(along) * 0.02, np.sin(along) * 0.02, along * 0.001], axis=1)  # a tight curl
    segments = bezier_segments.cubic(points, counts, basis, "nonperiodic")
    values, line_counts, places = bezier_segments.polylines(segments, bezier_segments.line_counts(segments))
    dense = at(segments, np.linspace(0.0, 1.0, 257))
    starts, ends = curve_offsets(line_counts), curve_offsets(segments.counts)
    for curve in range(len(counts)):
        line = values[starts[curve] : starts[curve + 1]]
        course = dense[ends[curve] : ends[curve + 1]].reshape(-1, 3)
        length = np.linalg.norm(np.diff(course, axis=0), axis=1).sum()
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(length, rel=1e-3)
        assert distances(course[::16], line).max() < 1.01 * bezier_segments.SAGITTA * 3.0 * length
        np.testing.assert_array_equal(line[[0, -1]], course[[0, -1]])
        its = places[starts[curve] : starts[curve + 1]]
        assert (np.diff(its) > 0.0).all() and its[0] == ends[curve] + curve
        assert its[-1] == its[0] + segments.counts[curve]


def distances(points, line):
    """Return the distances of points from a polyline."""
    start, leg = line[:-1], np.diff(line, axis=0)
    part = np.einsum("pld,ld->pl", points[:, None] - start, leg) / np.maximum((leg**2).sum(axis=1), 1e-30)
    nearest = start + np.clip(part, 0.0, 1.0)[..., None] * leg
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def test_straight_curves_are_as_few_lines_as_segments():
    points = np.column_stack([np.linspace(0.0, 1.0, 13), np.zeros(13), np.zeros(13)])
    for basis in bezier_segments.BASES:
        segments = bezier_segments.cubic(points, np.array([13]), basis, "nonperiodic")
        assert (bezier_segments.line_counts(segments) == 1).all()


def test_non_finite_points_harm_no_other_curve(rng):
    points = wandering(rng, 12)
    points[5] = np.nan
    segments = bezier_segments.cubic(points, np.array([4, 4, 4]), "bspline", "pinned")
    values, counts, _places = bezier_segments.polylines(segments, bezier_segments.line_counts(segments))
    alone = bezier_segments.cubic(points[8:], np.array([4]), "bspline", "pinned")
    wanted, (count,), _places = bezier_segments.polylines(alone, bezier_segments.line_counts(alone))
    np.testing.assert_array_equal(values[-count:], wanted)
    assert counts[2] == count and not np.isfinite(values[counts[0] : counts[0] + counts[1]]).all()


def test_curves_without_segments_are_no_polylines():
    """Curves with too few points for their basis have no segments and give no polyline, even if all curves of a file
    are so.
    """
    none = bezier_segments.Segments(np.zeros((0, 4, 3)), np.zeros(2, np.int64), np.zeros((0, 2)))
    values, counts, places = bezier_segments.polylines(none, np.zeros(0, np.int64))
    assert values.shape == (0, 3) and counts.tolist() == [0, 0] and places.shape == (0,)
    for weights in (None, np.zeros(0)):
        no_counts = np.zeros(0, np.int64)
        none = bezier_segments.nurbs(np.zeros((0, 3)), weights, no_counts, no_counts, np.zeros(0), None)
        assert bezier_segments.polylines(none, np.zeros(0, np.int64))[0].shape == (0, 3)
