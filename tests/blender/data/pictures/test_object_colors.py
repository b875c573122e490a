# SPDX-License-Identifier: GPL-3.0-or-later
"""*Random* in Solid shading gives hair the color that Blender gives a mesh of the same name."""

from types import SimpleNamespace

import numpy as np
import pytest

from hair_addon.blender.data.pictures import object_colors
from hair_addon.blender.data.pictures.viewport_shading import HairColor


def test_random_colors_are_those_that_blender_gives_the_name():
    """Random colors equal those of a mesh of the same name in a window of Blender 5.2, as display colors."""
    for name, shown in (("Suzanne.001", (203, 231, 170)),):
        linear = np.array(object_colors.random_color(name))
        display = 1.055 * linear ** (1.0 / 2.4) - 0.055
        np.testing.assert_allclose(255.0 * display, shown, atol=0.6)
    assert object_colors.random_color("Cube", "//library.blend") != object_colors.random_color("Cube")


def test_colors_of_objects_and_of_all():
    shown = SimpleNamespace(color=(0.1, 0.2, 0.3, 1.0))
    assert object_colors.color_of(shown, HairColor("OBJECT")) == pytest.approx((0.1, 0.2, 0.3))
    assert object_colors.color_of(shown, HairColor("SINGLE", (0.4, 0.5, 0.6))) == (0.4, 0.5, 0.6)
