# SPDX-License-Identifier: GPL-3.0-or-later
"""B-splines satisfy their laws, and the three ways to evaluate them agree with each other and with scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from hair_addon.core.geometry.curves import bspline

degrees_and_counts = st.integers(1, 5).flatmap(lambda p: st.tuples(st.just(p), st.integers(p + 1, 12)))


@given(shape=degrees_and_counts, t=st.floats(0.0, 1.0))
def test_basis_is_a_partition_of_unity(shape, t):
    degree, control_count = shape
    values = bspline.basis([0.0, t, 1.0], control_count, degree)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-12)
    assert values.min() >= 0.0


@given(shape=degrees_and_counts)
def test_basis_equals_scipy(shape):
    degree, control_count = shape
    t = np.linspace(0.0, 1.0, 97)
    knots = bspline.clamped_knots(control_count, degree)
    expected = BSpline(knots, np.eye(control_count), degree)(t)
    np.testing.assert_allclose(bspline.basis(t, control_count, degree), expected, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_a_curve_starts_and_ends_at_its_controls(rng, degree):
    controls = rng.normal(size=(4, 6, 3))
    ends = bspline.evaluate_recursive(controls, [0.0, 1.0], degree)
    np.testing.assert_allclose(ends, controls[:, [0, -1]], atol=1e-12)


def test_a_curve_moves_with_its_controls(rng):
    """A curve moves with its controls: transforming controls or points is the same."""
    controls, matrix, shift = rng.normal(size=(4, 6, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    t = np.linspace(0.0, 1.0, 41)
    moved = bspline.evaluate_recursive(controls @ matrix + shift, t)
    np.testing.assert_allclose(moved, bspline.evaluate_recursive(controls, t) @ matrix + shift, atol=1e-12)


def test_weights_make_a_circle():
    """A rational quadratic spline is exactly a quarter of a circle [Piegl97]; plain splines cannot be."""
    controls = np.array([[(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]])
    points = bspline.evaluate_recursive(controls, np.linspace(0.0, 1.0, 50), 2, weights=[1.0, 0.5**0.5, 1.0])
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 1.0, atol=1e-12)


def test_equal_weights_change_nothing(rng):
    controls, t = rng.normal(size=(4, 6, 3)), np.linspace(0.0, 1.0, 41)
    weighted = bspline.evaluate_recursive(controls, t, weights=np.full((4, 6), 0.3))
    np.testing.assert_allclose(weighted, bspline.evaluate_recursive(controls, t), atol=1e-12)


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_controls_at_greville_abscissae_draw_an_even_line(degree):
    places = bspline.greville_abscissae(7, degree)
    controls = places[None, :, None] * np.array([1.0, -2.0, 0.5])
    t = np.linspace(0.0, 1.0, 23)
    np.testing.assert_allclose(bspline.evaluate_recursive(controls, t, degree)[0], t[:, None] * [1.0, -2.0, 0.5])


def test_three_subdivisions_turn_six_controls_into_41_points(rng):
    controls = rng.normal(size=(3, 6, 3))
    points = bspline.subdivide(controls, 3)
    assert points.shape == (3, 41, 3)
    np.testing.assert_array_equal(points[:, [0, -1]], controls[:, [0, -1]])  # Eq. 5


def test_subdivision_tends_to_the_uniform_spline_with_mirrored_ends(rng):
    controls = rng.normal(size=(3, 6, 3))
    before, after = 2 * controls[:, :1] - controls[:, 1:2], 2 * controls[:, -1:] - controls[:, -2:-1]
    mirrored = np.concatenate([before, controls, after], axis=1)
    limit = BSpline(np.arange(-3.0, 9.0), mirrored, 3, axis=1)(np.linspace(0.0, 5.0, 41))
    # Points lie off the curve by a sixth of their second difference, fourfold less with every level.
    points = bspline.subdivide(controls, 3)
    points[:, 1:-1] += np.diff(points, n=2, axis=1) / 6.0
    np.testing.assert_allclose(points, limit, atol=1e-12)
    distances = [np.abs(bspline.subdivide(controls, n)[:, :: 2 ** (n - 3)] - limit).max() for n in (3, 4, 5)]
    np.testing.assert_allclose(np.divide(distances[:-1], distances[1:]), 4.0, rtol=1e-6)


def test_matrix_equals_recursion(rng, device):
    controls = rng.normal(size=(200, 6, 3)).astype(np.float32)
    expected = bspline.evaluate_recursive(controls, np.linspace(0.0, 1.0, 41))
    size = np.abs(controls).max()
    np.testing.assert_allclose(bspline.basis_matrix(6, 41) @ controls, expected, atol=1e-12)
    found = bspline.evaluate(controls, 41, device).numpy()
    np.testing.assert_allclose(found, expected, atol=1e-6 * size)
    np.testing.assert_array_equal(bspline.evaluate(controls[7:9], 41, device).numpy(), found[7:9])


@pytest.mark.parametrize(("control_count", "point_count", "degree"), [(4, 2, 3), (5, 16, 2), (9, 100, 5)])
def test_matrix_of_any_shape(rng, device, control_count, point_count, degree):
    controls = rng.random((3, control_count, 3), dtype=np.float32)
    expected = bspline.evaluate_recursive(controls, np.linspace(0.0, 1.0, point_count), degree)
    np.testing.assert_allclose(bspline.evaluate(controls, point_count, device, degree).numpy(), expected, atol=1e-6)


@pytest.mark.parametrize("count", [4, 6, 16])
def test_controls_of_curves_through_points(rng, count):
    points = rng.random((5, count, 3), dtype=np.float32)
    controls = bspline.controls_through(points)
    at_points = bspline.evaluate_recursive(controls, bspline.greville_abscissae(count))
    np.testing.assert_allclose(at_points, points, atol=1e-5)
    np.testing.assert_array_equal(bspline.controls_through(points[3:]), controls[3:])


@pytest.mark.parametrize(("control_count", "degree"), [(3, 3), (1, 1), (6, 0), (6, 6)])
def test_too_few_controls_are_refused(control_count, degree):
    with pytest.raises(ValueError, match="B-spline"):
        bspline.clamped_knots(control_count, degree)
