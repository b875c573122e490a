# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose nodes Cycles renders cast their pattern on hair and surfaces."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from hair_addon.blender.data.pictures import light_panoramas
from hair_addon.blender.render import offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings


@pytest.fixture
def lamp(lit):
    """Return a turned, mirrored spot above the hair; the sun is off."""
    bpy.data.objects["Sun"].hide_render = True
    spot = bpy.data.lights.new("Spot", "SPOT")
    spot.energy, spot.spot_size = 2000.0, 1.5
    lamp = bpy.data.objects.new("Spot", spot)
    bpy.context.scene.collection.objects.link(lamp)
    turn = Euler((0.0, 0.0, 0.7)).to_matrix().to_4x4()
    lamp.matrix_world = Matrix.Translation((0.0, 0.0, 5.0)) @ turn @ Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0))
    return lamp


def picture(monkeypatch, pattern, is_scaled=False):
    """Return (height, width, 3) light of the scene; pattern: (H, W, 3) light of the lamp, None without nodes."""
    plain = None if pattern is None else np.ones(pattern.shape[:2])
    panorama = None if pattern is None else light_panoramas.Panorama(pattern, plain, is_scaled)
    monkeypatch.setattr(light_panoramas, "find", lambda *_given: panorama)
    bpy.context.view_layer.update()
    return offscreen.draw_picture(PictureSettings(48, 36, 2, is_transparent=True))[..., :3].astype(float)


def test_patterns_are_parts_of_the_light(lamp, monkeypatch):
    """Light of the halves of a pattern adds up to the light without one, and each half lights its own side."""
    plain = picture(monkeypatch, None)
    first = np.zeros((128, 256, 3))
    first[:, 64:192] = 1.0, 0.7, 0.4  # directions along the lamp's x axis
    one, other = (picture(monkeypatch, pattern) for pattern in (first, 1.0 - first))
    np.testing.assert_allclose(one + other, plain, atol=0.02 * plain.max())
    shares = one.sum(axis=(0, 1)) / plain.sum(axis=(0, 1))
    assert (0.1 < shares).all() and shares[0] > shares[1] > shares[2] and (shares < 0.9).all()
    is_bright = plain[..., 0] > 0.1 * plain[..., 0].max()
    of_pixels = (one / np.maximum(plain, 1e-6))[is_bright][:, 0]
    assert np.mean((of_pixels < 0.05) | (of_pixels > 0.95)) > 0.6


def test_an_uneven_scale_distorts_the_pattern(lamp, monkeypatch):
    """As in Cycles, where a disk of 3.3 m has 1.1 m along an axis with the scale 3: nodes read transformed normals."""
    rows, columns = (np.arange(count) + 0.5 for count in (256, 512))
    latitude, longitude = np.pi * (rows[:, None] / 256 - 0.5), 2.0 * np.pi * (0.5 - columns / 512)
    scale = 0.03, 0.01, 0.01
    level = np.broadcast_to(np.sin(latitude), (256, 512))
    across = np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), level
    scaled = np.multiply(scale, np.stack(across, axis=-1))
    pattern, distorted = (
        np.tanh(40.0 * (np.float32(-0.99) - z)) + 1.0 for z in (level, scaled[..., 2] / np.linalg.norm(scaled, axis=-1))
    )
    expected = picture(monkeypatch, np.repeat(distorted[..., None], 3, axis=2))
    plain = picture(monkeypatch, np.repeat(pattern[..., None], 3, axis=2))
    lamp.matrix_world = lamp.matrix_world @ Matrix.Diagonal((*scale, 1.0))
    found = picture(monkeypatch, np.repeat(pattern[..., None], 3, axis=2), is_scaled=True)
    assert np.abs(found - expected).mean() < 0.02 * expected.mean()
    assert np.abs(plain - expected).mean() > 0.2 * expected.mean()


def test_an_even_pattern_is_a_factor(lamp, monkeypatch):
    even = picture(monkeypatch, np.full((32, 64, 3), 0.25))
    np.testing.assert_allclose(even, 0.25 * picture(monkeypatch, None), rtol=0.01, atol=1e-4)


def test_the_texel_of_a_direction_is_the_factor_toward_it(rng):
    """Hair at one place has the factor of the pattern there, for a lamp that is turned, moved, mirrored and unevenly
    scaled."""
    panorama = light_panoramas.Panorama(rng.uniform(0.5, 2.0, (512, 1024, 3)), rng.uniform(0.5, 1.0, (512, 1024)), True)
    turn, scale = Euler((1.0, 0.5, 0.2)).to_matrix().to_4x4(), Matrix.Diagonal((100.0, -1.0, 0.01, 1.0))
    matrix = np.array(Matrix.Translation((1.0, 2.0, 3.0)) @ turn @ scale)
    latitude, longitude = np.pi * (400.5 / 512 - 0.5), 2.0 * np.pi * (0.5 - 100.5 / 1024)
    along = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    place = matrix[:3, 3] + 2.0 * np.linalg.solve(panorama.axes(matrix).T, along)
    np.testing.assert_allclose(panorama.factor(matrix, place), panorama.pattern[400, 100], rtol=1e-4)
