# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and its surface are each lit by the lights that are linked to them."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu.programs import uniforms
from hair_addon.blender.render import offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pictures.rendering import rendered

NAMES = ("Hair", "Sphere")


@pytest.fixture
def suns(lit):
    """Return {object's name: a sun with its own color beside the camera}, with a white object."""
    bpy.data.objects["Sun"].hide_render = True
    found = {}
    for name, color in zip(NAMES, ((1.0, 0.2, 0.2), (0.2, 0.2, 1.0)), strict=True):
        sun = bpy.data.objects.new(f"Sun of {name}", bpy.data.lights.new(f"Sun of {name}", "SUN"))
        sun.rotation_euler, sun.data.color, sun.data.energy = (math.pi / 3, 0.0, 0.3), color, 3.0
        bpy.context.scene.collection.objects.link(sun)
        found[name] = sun
    return found


def picture():
    bpy.context.view_layer.update()
    return offscreen.draw_picture(PictureSettings(48, 36, 1, is_transparent=True))


def link(light, name, state="INCLUDE", role="receiver"):
    collection = bpy.data.collections.new("Linked")
    collection.objects.link(bpy.data.objects[name])
    collection.collection_objects[0].light_linking.link_state = state
    setattr(light.light_linking, f"{role}_collection", collection)


def alone(suns, name):
    """Return the picture in the light of one of the suns."""
    for other, sun in suns.items():
        sun.hide_render = other != name
    found = picture()
    for sun in suns.values():
        sun.hide_render = False
    return found


@pytest.mark.parametrize("state", ["INCLUDE", "EXCLUDE"])
def test_each_is_lit_by_its_own_lights(suns, tmp_path, state):
    """Each sample shows hair in the light of one sun or the surface in that of the other."""
    expected = {name: alone(suns, name) for name in NAMES}
    for name, other in zip(NAMES, NAMES[::-1], strict=True):
        link(suns[name], name if state == "INCLUDE" else other, state)
    found = picture()
    bpy.context.view_layer.vellus.has_hair_mask = True
    is_hair = rendered(tmp_path, sample_count=1, resolution_x=48, resolution_y=36)["Hair Mask"] > 0.5
    is_surface = ~is_hair & (found[..., 3] > 0.5)
    assert is_hair.sum() > 30 and is_surface.sum() > 30
    for name, where in zip(NAMES, (is_hair, is_surface), strict=True):
        np.testing.assert_allclose(found[where], expected[name][where], rtol=2e-3, atol=1e-4)
    assert np.abs(expected["Hair"] - expected["Sphere"])[is_hair | is_surface].max() > 0.05


def test_hair_that_is_no_blocker_casts_no_shadow(suns, fine_shadows):
    """Hair that is no blocker casts no shadow, so the surface is lit as if the hair were absent."""
    shadowed = picture()
    for sun in suns.values():
        link(sun, "Hair", "EXCLUDE", "blocker")
    free = picture()
    bpy.data.objects["Hair"].hide_set(True)
    bare = picture()
    is_surface = np.isclose(free, bare, atol=1e-3).all(axis=-1) & (free[..., 3] > 0.5)
    assert is_surface.sum() > 30
    assert shadowed[is_surface, :3].sum() < 0.97 * free[is_surface, :3].sum()


def test_ambient_light_of_lights_without_room_is_linked_too(suns, monkeypatch):
    """With one drawn light, the other light is ambient light of its linked hair alone."""
    monkeypatch.setattr(uniforms, "LIGHT_CAPACITY", 1)
    suns["Sphere"].data.energy = 0.5
    link(suns["Sphere"], "Hair")
    link(suns["Hair"], "Sphere")
    found = picture()
    bpy.data.objects["Hair"].hide_set(True)
    surface = picture()[..., :3]
    assert (surface[..., 2] <= 0.21 * surface[..., 0] + 1e-4).all()  # in the light of the red sun alone
    assert found[..., 2].max() > 0.05
