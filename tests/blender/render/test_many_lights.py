# SPDX-License-Identifier: GPL-3.0-or-later
"""More lights than are drawn individually lose no light."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu.programs import uniforms
from hair_addon.blender.render import offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings

COUNT = 24


@pytest.fixture
def lamps(lit):
    """Return lamps of five brightnesses all around the hair; the sun is off."""
    bpy.data.objects["Sun"].hide_render = True
    found = []
    for index in range(COUNT):
        height, turn = 1.0 - (2.0 * index + 1.0) / COUNT, index * math.pi * (3.0 - math.sqrt(5.0))
        lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
        across = 6.0 * math.sqrt(1.0 - height**2)
        lamp.location = across * math.cos(turn), across * math.sin(turn), 6.0 * height
        lamp.data.energy = 300.0 * (1 + index % 5)
        bpy.context.scene.collection.objects.link(lamp)
        found.append(lamp)
    return found


def light():
    """Return (height, width, 3) light."""
    bpy.context.view_layer.update()
    return offscreen.draw_picture(PictureSettings(48, 36, 2, is_transparent=True))[..., :3].astype(float)


def light_of(lamps, chosen):
    for lamp in lamps:
        lamp.hide_render = lamp not in chosen
    return light()


def test_many_lights_are_the_sum_of_all(lamps):
    """A picture with many lights is the sum of pictures with one light each."""
    together = light()
    size = uniforms.LIGHT_CAPACITY
    each = sum(light_of(lamps, lamps[first : first + size]) for first in range(0, COUNT, size))
    np.testing.assert_allclose(together.mean(axis=(0, 1)), each.mean(axis=(0, 1)), rtol=0.02)
    assert np.abs(together - each).sum() < 0.12 * each.sum()


def test_those_are_drawn_that_reach_the_hair(lamps):
    """Only lamps that reach the hair are drawn: a far brighter lamp that does not light the hair takes no place."""
    before = light_of(lamps, lamps[:16])
    for turned in lamps[16:]:
        turned.data.type = "SPOT"
        spot = bpy.data.lights[turned.data.name]
        spot.energy, spot.spot_size = 1e6, math.radians(60.0)
        turned.rotation_euler = turned.location.to_track_quat("-Z", "Y").to_euler()  # away from the hair
    np.testing.assert_allclose(light_of(lamps, lamps), before, atol=1e-5)
