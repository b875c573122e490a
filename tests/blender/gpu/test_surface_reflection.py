# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights on surfaces obey the laws of their distributions of normals."""

import numpy as np
import pytest

from tests.support.pictures import glsl


@pytest.mark.parametrize("half_radius, alpha", [(0.09, 0.002), (0.05, 0.01), (0.03, 0.03)])
def test_a_disk_is_mirrored_with_the_light_that_it_sends(half_radius, alpha):
    """The integral of a disk's mirrored light over all normals is one; a smooth surface shows the disk with its border.

    A smooth surface shows a uniform disk with a border.
    """
    angle = np.linspace(0.0, 1.2, 40_001)
    text = glsl.source("surfaces/surface_reflection.glsl")
    values = glsl.evaluate(
        text, "float", f"D_ggx_of_disk(n_dot_h, {half_radius}, {alpha})", n_dot_h=np.cos(angle).astype(np.float32)
    )
    values = np.asarray(values, np.float64).ravel()
    np.testing.assert_allclose(
        np.trapezoid(2.0 * np.pi * np.sin(angle) * np.cos(angle) * values, angle), 1.0, rtol=0.03
    )
    inside = values[(angle > 0.01) & (angle < 0.9 * half_radius)]
    np.testing.assert_allclose(inside, values[0], rtol=1e-3)
    assert values[angle > half_radius + 5.0 * alpha].max() < 0.01 * values[0]
