# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels have notes on outdated hair, and on baked frames of guides that were combed since."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.live import dynamics_state
from tests.support.dynamics.swung import simulate
from tests.support.guide_tools import grown_from_nothing
from tests.support.interface.layout import draw
from tests.support.reading import points, write_points

SENTENCE = "Out of date: settings or inputs have changed."


def is_said(name):
    shown = draw(getattr(bpy.types, f"VELLUS_PT_{name}"))
    reported = SENTENCE in " ".join(shown.texts)
    assert shown.drawn["vellus.update_hair"] == reported
    return reported


def comb(guides, amount=0.2):
    combed = points(guides)
    combed[:, -1] += amount
    write_points(guides, combed)


def scale_mesh(sphere):
    for vertex in sphere.data.vertices:
        vertex.co *= 1.5
    sphere.data.update()
    bpy.context.view_layer.update()


def test_hair_without_auto_update_says_that_it_is_out_of_date_and_updates_when_asked(hair):
    guides, sphere = bpy.data.objects["Guides"], bpy.data.objects["Sphere"]
    guides.data.vellus.is_live = hair.data.vellus.is_live = False
    bpy.context.view_layer.update()
    assert not is_said("interpolation") and not is_said("guides")
    before = points(hair)
    comb(guides)
    assert is_said("interpolation") and not is_said("guides")
    np.testing.assert_array_equal(points(hair), before)
    bpy.ops.vellus.update_hair()
    assert not is_said("interpolation") and not hair.data.vellus.is_live
    np.testing.assert_array_equal(points(hair), grown_from_nothing(hair))
    assert not np.array_equal(points(hair), before)
    scale_mesh(sphere)
    assert is_said("interpolation") and is_said("guides")
    bpy.ops.vellus.update_hair()
    assert not is_said("interpolation") and not is_said("guides")
    assert guides.data.vellus.status == hair.data.vellus.status == ""
    radii = np.linalg.norm(points(hair)[:, 0], axis=1)
    np.testing.assert_allclose(radii, 1.5, atol=0.01)


@pytest.mark.parametrize("setting", ["radius", "strand_count"])
def test_switched_on_it_is_up_to_date_at_once(hair, setting):
    hair.data.vellus.is_live = False
    setattr(hair.data.vellus.hair, setting, 0.02 if setting == "radius" else 100)
    bpy.context.view_layer.update()
    assert is_said("interpolation")
    hair.data.vellus.is_live = True
    bpy.context.view_layer.update()
    assert not is_said("interpolation")
    assert len(hair.data.curves) == hair.data.vellus.hair.strand_count
    assert hair.data.attributes["radius"].data[0].value == pytest.approx(hair.data.vellus.hair.radius)
    assert not bpy.ops.vellus.update_hair.poll()


def test_frames_are_not_said_to_be_baked_of_guides_that_were_combed_since(hair, tmp_path):
    guides = bpy.data.objects["Guides"]
    simulate(guides, tmp_path / "frames")
    api.bake_dynamics(guides, 3)
    bpy.context.scene.frame_set(2)
    baked, combed = points(guides), "Frames {first} to {last} are baked with other settings or guides: bake again"
    assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
    comb(guides)
    assert dynamics_state.state_of(guides.data) == (combed, {"first": 1, "last": 3})
    assert "are baked with other settings or guides" in " ".join(draw(bpy.types.VELLUS_PT_dynamics).texts)
    write_points(guides, baked)
    bpy.context.scene.frame_set(3)
    assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
