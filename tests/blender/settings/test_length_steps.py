# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths are dragged in steps that fit the surface, by steps measured in a window of Blender 5.2 and the shown
rows.
"""

import bpy
import pytest

from hair_addon.blender.settings import length_steps
from hair_addon.blender.ui import setting_rows
from tests.support.interface.layout import Layout


def use(scene, system, scale):
    scene.unit_settings.system, scene.unit_settings.scale_length = system, scale


METERS, CENTIMETERS, UNITLESS, INCHES = ("METRIC", 1.0), ("METRIC", 0.01), ("NONE", 1.0), ("IMPERIAL", 1.0)


@pytest.mark.parametrize(
    ("units", "step", "moved"),
    [
        *((METERS, 0.03, 0.001), (METERS, 0.1, 0.01), (METERS, 3.0, 0.01), (CENTIMETERS, 0.03, 1e-4)),
        *((CENTIMETERS, 3.0, 0.1), (UNITLESS, 0.03, 3e-4), (UNITLESS, 3.0, 0.03)),
        *((INCHES, 0.03, 2.54e-5), (INCHES, 3.0, 0.0254)),
    ],
)
def test_a_pixel_goes_as_far_as_in_a_window(scene, units, step, moved):
    use(scene, *units)
    assert length_steps.per_pixel(step) == pytest.approx(moved)


@pytest.mark.parametrize(
    ("units", "size", "is_coarse"),
    [
        *((METERS, 0.25, False), (METERS, 2.0, False), (METERS, 12.0, True), (CENTIMETERS, 25.0, True)),
        *((CENTIMETERS, 170.0, True), (INCHES, 0.25, False), (UNITLESS, 0.25, False), (UNITLESS, 25.0, True)),
    ],
)
def test_rows_show_a_length_in_steps_that_fit(hair, units, size, is_coarse):
    """Rows show lengths in fitting steps for a head, an animal and a giant in several units, at most two steps of
    ten off.
    """
    use(bpy.context.scene, *units)
    sphere = bpy.data.objects["Sphere"]
    sphere.scale = (0.5 * size,) * 3
    bpy.context.view_layer.update()
    guides = bpy.data.objects["Guides"].data.vellus.guides
    shown = length_steps.shown_name(guides, "length")
    assert (shown != "length") == is_coarse
    moved = length_steps.per_pixel(length_steps.COARSE if is_coarse else length_steps.FINE)
    assert size / 1e4 <= moved <= size / 1e2
    layout = Layout()
    setting_rows.row(layout, guides, "length", "length")
    assert layout.drawn == {"label": 1, shown: 1, "fits_length": 1} | ({"key of length": 1} if is_coarse else {})


def test_both_are_one_length(hair):
    state = bpy.data.objects["Guides"].data.vellus
    coarse = length_steps.coarse_name("length")
    assert getattr(state.guides, coarse) == state.guides.length == 0.5
    setattr(state.guides, coarse, 0.25)
    assert state.guides.length == 0.25 and not state.guides.fits_length
    bpy.context.view_layer.update()
    assert state.status == ""
    names = [entry.identifier for entry in state.dynamics.bl_rna.properties]
    assert length_steps.coarse_name("collision_distance") in names
    assert length_steps.coarse_name("friction") not in names


def test_a_keyed_length_is_shown_by_its_own_property(hair):
    bpy.data.objects["Sphere"].scale = (20.0, 20.0, 20.0)
    bpy.context.view_layer.update()
    dynamics = bpy.data.objects["Guides"].data.vellus.dynamics
    assert length_steps.shown_name(dynamics, "collision_distance") != "collision_distance"
    dynamics.keyframe_insert("collision_distance", frame=1)
    assert length_steps.shown_name(dynamics, "collision_distance") == "collision_distance"
