# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair reflects light to a surface beside it."""

import bpy
import numpy as np

from hair_addon import api
from hair_addon.blender.render import hair_cache

from .test_light_through_hair import PERIOD, light_along_x, plane_and_sun

HEIGHT, LENGTH, THICKNESS = 0.06, 0.8, 0.004  # [m] of a wall of hair over the middle of the plane
STRAND_COUNT = 1500
ELEVATION = np.radians(40.0)  # of a sun on the side of +X


def add_wall(scene, plane, rng, look):
    """Add a wall of strands along Y, twenty deep; returns the part of light that infinite hair reflects."""
    x, z = rng.uniform(-THICKNESS, 0.0, STRAND_COUNT), rng.uniform(0.0, HEIGHT, STRAND_COUNT)
    points = np.stack(np.broadcast_arrays(x[:, None], LENGTH * np.linspace(-0.5, 0.5, 3), z[:, None]), axis=-1)
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([3] * STRAND_COUNT)
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radius = 20.0 * HEIGHT / STRAND_COUNT / 2.0
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set(
        "value", np.full(points.shape[:2], radius, np.float32).ravel()
    )
    curves.surface = plane
    scene.collection.objects.link(bpy.data.objects.new("Hair", curves))
    curves.vellus.kind, curves.vellus.marschner.size = "HAIR", 16
    api.shade(curves, look, model="MARSCHNER", mode="energy", random_color=0.0)
    return hair_cache.shading_of(curves).reflectance


def light_off_matt_wall(x, reflectance):
    """Return the radiance of a white plane at distances (N,) [m] from a matte wall that the sun lights, by a sum
    over its area.
    """
    y, z = np.meshgrid(np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 401), HEIGHT * (np.arange(60) + 0.5) / 60.0)
    squared = x[:, None, None] ** 2 + y**2 + z**2
    area = LENGTH / 401.0 * HEIGHT / 60.0
    seen = (x[:, None, None] * z / squared**2).sum(axis=(1, 2)) * area / np.pi
    return seen[:, None] * reflectance * np.cos(ELEVATION)


def test_a_plane_takes_light_off_a_wall_of_hair(scene, rng):
    """A plane receives as much light from a wall of hair as from a matte wall of the same albedo, and none behind
    the hair.
    """
    reflectance = add_wall(scene, plane_and_sun(scene, ELEVATION), rng, "BLOND")
    light = light_along_x(pass_count=8)
    x = (np.arange(len(light)) + 0.5) / len(light) * 6.0 * PERIOD - 3.0 * PERIOD
    beside = (x > 0.02) & (x < 0.1)
    found = (light[beside] - np.sin(ELEVATION)).mean(axis=0)
    np.testing.assert_allclose(found, light_off_matt_wall(x[beside], reflectance).mean(axis=0), rtol=0.15)
    assert light[x < -0.02].max() < 1.01 * np.sin(ELEVATION)
