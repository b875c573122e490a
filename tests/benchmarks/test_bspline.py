# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of evaluating 200 curves of 6 controls at 41 points ([Report12] section 5), by Vellus and by scipy in the same
run.
"""

import time

import numpy as np
import pytest
from scipy.interpolate import BSpline

from hair_addon.core.geometry.curves import bspline


def medians(ways, repetitions=200):
    """Return the median time [s] of each method, called in turns so that all run under the same load."""
    times = {name: [] for name in ways}
    for _ in range(repetitions):
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            times[name].append(time.perf_counter() - start)
    return {name: float(np.median(measured[repetitions // 10 :])) for name, measured in times.items()}


@pytest.mark.long
def test_matrix_beside_scipy(rng):
    controls = rng.random((200, 6, 3), dtype=np.float32)
    parameters = np.linspace(0.0, 1.0, 41)
    knots = bspline.clamped_knots(6)
    made = BSpline(knots, controls, 3, axis=1)
    times = medians(
        {
            "scipy, evaluation alone": lambda: made(parameters),
            "scipy": lambda: BSpline(knots, controls, 3, axis=1)(parameters),
            "recursion": lambda: bspline.evaluate_recursive(controls, parameters),
            "subdivision": lambda: bspline.subdivide(controls, 3),
            "matrix": lambda: bspline.evaluate(controls, 41),
        }
    )
    for name, seconds in times.items():
        print(f"{name:24} {1e6 * seconds:8.1f} µs   {seconds / times['scipy']:6.2f} × scipy")
    assert times["matrix"] <= 4.0 * times["scipy"]
