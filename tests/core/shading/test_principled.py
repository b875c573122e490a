# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness of Blender's Principled Hair against published widths, and there and back."""

import numpy as np
import pytest

from hair_addon.core.shading import principled


@pytest.mark.parametrize(("roughness", "degrees"), [(0.1, 2.31), (0.2, 5.09), (0.3, 8.33)])
def test_roughness_gives_the_published_width(roughness, degrees):
    assert np.degrees(principled.beta_r_from_roughness(roughness)) == pytest.approx(degrees, abs=0.01)


@pytest.mark.parametrize("roughness", [0.02, 0.3, 0.77, 0.99])
def test_roughness_survives_the_way_there_and_back(roughness):
    assert principled.roughness_from_beta_r(principled.beta_r_from_roughness(roughness)) == pytest.approx(
        roughness, abs=1e-5
    )
