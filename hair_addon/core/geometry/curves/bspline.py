# SPDX-License-Identifier: GPL-3.0-or-later
"""B-spline curves in three ways: recursive basis, subdivision, and a constant matrix in Warp  ([Report12] 2.2).

The report states that the first two cannot run in parallel. Curves are always evaluated at the same parameters,
however, so the basis is computed once, and each point is a small product with the control points.
"""

from functools import lru_cache, reduce

import numpy as np
import warp as wp

from ...kernels import kernel_cache

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def clamped_knots(control_count: int, degree: int = 3) -> np.ndarray:
    """Return clamped knots (control_count + degree + 1,) on [0, 1]: curves start and end at their controls."""
    if not 1 <= degree < control_count:
        raise ValueError(f"a B-spline of degree {degree} needs more than {degree} control points, not {control_count}")
    inside = np.linspace(0.0, 1.0, control_count - degree + 1)
    return np.concatenate([np.zeros(degree), inside, np.ones(degree)])


def greville_abscissae(control_count: int, degree: int = 3) -> np.ndarray:
    """Return the parameters (control_count,) at which controls on a line give a uniform parametrization."""
    knots = clamped_knots(control_count, degree)
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(control_count)])


def basis(parameters: np.ndarray, control_count: int, degree: int = 3) -> np.ndarray:
    """Return N_{i,p}(t), (T, control_count) float64, at t (T,) in [0, 1], by the recursion of Cox and de Boor."""
    knots = clamped_knots(control_count, degree)
    t = np.asarray(parameters, dtype=np.float64)[:, None]
    values = ((knots[:-1] <= t) & (t < knots[1:])).astype(np.float64)  # Eq. 2
    # Spans are half-open, except for the last non-empty one, which includes the tip.
    values[t[:, 0] == 1.0, control_count - 1] = 1.0
    for p in range(1, degree + 1):  # Eq. 3, with 0/0 = 0 where knots repeat
        rising = _ratio(t - knots[: -p - 1], knots[p:-1] - knots[: -p - 1])
        falling = _ratio(knots[p + 1 :] - t, knots[p + 1 :] - knots[1:-p])
        values = rising * values[:, :-1] + falling * values[:, 1:]
    return values


def evaluate_recursive(
    controls: np.ndarray, parameters: np.ndarray, degree: int = 3, weights: np.ndarray | None = None
) -> np.ndarray:
    """Return points (C, T, 3) float64 [m] of controls (C, n, 3) [m] at parameters (T,) in [0, 1].  Eq. 1 as corrected.

    weights: (n,) or (C, n), positive, for rational curves (NURBS); None for polynomial curves.
    """
    controls = np.asarray(controls, dtype=np.float64)
    values = basis(parameters, controls.shape[1], degree)
    if weights is None:
        return values @ controls
    weights = np.broadcast_to(np.asarray(weights, dtype=np.float64), controls.shape[:2])[..., None]
    return (values @ (weights * controls)) / (values @ weights)


def subdivide(controls: np.ndarray, levels: int) -> np.ndarray:
    """Return controls (C, n, 3) [m] subdivided to (C, (n - 1) 2^levels + 1, 3) float64 [m]; levels add midpoints.

    The limit curve is the *uniform* cubic B-spline with a mirrored phantom control at each end, which differs from the
    clamped curve of `evaluate_recursive`. The points converge to the limit curve.
    """
    points = np.asarray(controls, dtype=np.float64)
    for _ in range(levels):
        finer = np.empty((points.shape[0], 2 * points.shape[1] - 1, 3))
        finer[:, 2:-1:2] = (points[:, :-2] + 6.0 * points[:, 1:-1] + points[:, 2:]) / 8.0  # Eq. 4
        finer[:, 1::2] = (points[:, :-1] + points[:, 1:]) / 2.0
        finer[:, 0], finer[:, -1] = points[:, 0], points[:, -1]  # Eq. 5
        points = finer
    return points


@lru_cache(maxsize=16)
def basis_matrix(control_count: int, point_count: int, degree: int = 3) -> np.ndarray:
    """Return W (point_count, control_count) float64, read-only: points = W @ controls, at uniform parameters."""
    matrix = basis(np.linspace(0.0, 1.0, point_count), control_count, degree)
    matrix.flags.writeable = False
    return matrix


def evaluate(
    controls: np.ndarray, point_count: int, device: wp.DeviceLike = "cpu", degree: int = 3
) -> wp.array2d[wp.vec3]:
    """Return points (C, point_count) vec3 [m] of controls (C, n, 3) float32 [m], on the device, by the constant matrix.

    BLAS is not used, because its rounding depends on the processor.
    """
    controls = wp.array(np.asarray(controls, dtype=np.float32), dtype=wp.vec3, device=device)
    matrix = _device_matrix(controls.shape[1], point_count, degree, device)
    points = wp.empty((controls.shape[0], point_count), dtype=wp.vec3, device=device)
    kernel_cache.launch(_evaluate, dim=points.shape, inputs=[controls, matrix], outputs=[points], device=device)
    return points


@wp.kernel
def _evaluate(
    controls: wp.array2d[wp.vec3],
    matrix: wp.array2d[float],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    curve, point = wp.tid()
    position = wp.vec3()
    for i in range(matrix.shape[1]):
        position += matrix[point, i] * controls[curve, i]
    out_points[curve, point] = position


@lru_cache(maxsize=16)
def _device_matrix(control_count, point_count, degree, device):
    """Return W (point_count, control_count) float32 on the device."""
    return wp.array(basis_matrix(control_count, point_count, degree), dtype=float, device=device)


def controls_through(points: np.ndarray, degree: int = 3) -> np.ndarray:
    """Return the controls (C, n, 3) of curves through points (C, n, 3) float32 [m] at the Greville abscissae.

    Sums have a fixed order, as in `evaluate`.
    """
    matrix = _controls_matrix(points.shape[1], degree)
    terms = (matrix[:, i, None] * points[:, i, None] for i in range(points.shape[1]))
    return reduce(np.add, terms)


@lru_cache(maxsize=16)
def _controls_matrix(count, degree):
    """Return (count, count) float32: controls = matrix @ points at the abscissae, by elimination without pivoting."""
    rows = np.concatenate([basis(greville_abscissae(count, degree), count, degree), np.eye(count)], axis=1)
    for i in range(count):
        rows[i] /= rows[i, i]
        others = np.arange(count) != i
        rows[others] -= rows[others, i, None] * rows[i]
    return rows[:, count:].astype(np.float32)


def _ratio(numerator, denominator):
    """Return numerator / denominator, zero where the denominator is not positive."""
    return np.where(denominator > 0.0, numerator, 0.0) / np.where(denominator > 0.0, denominator, 1.0)
