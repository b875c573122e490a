# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of light groups are the parts of the picture by the lights of each group, as in Cycles."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

from tests.support.pairs import share_of
from tests.support.pictures.rendering import light_up, rendered

SIZE = {"resolution_x": 32, "resolution_y": 24, "sample_count": 4}


@pytest.fixture
def grouped(lit):
    """Return a scene with a sun, a world and a lamp in groups of their own; the last group has no light."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    scene.camera.data.lens = 100.0
    light_up((0.1, 0.15, 0.3))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy, lamp.data.color = (-2.0, -3.0, -1.0), 300.0, (1.0, 0.5, 0.2)
    scene.collection.objects.link(lamp)
    for name in ("Key", "Fill", "Sky", "Unused"):
        layer.lightgroups.add().name = name
    bpy.data.objects["Sun"].lightgroup, lamp.lightgroup, scene.world.lightgroup = "Key", "Fill", "Sky"
    return lit


def groups_of(passes):
    return {name.removeprefix("Combined_"): light for name, light in passes.items() if name.startswith("Combined_")}


@pytest.mark.parametrize("how", share_of(["DUAL", "GRID", "motion blur", "panorama"], 2))
def test_groups_sum_to_the_picture(grouped, tmp_path, how):
    """The passes sum to the picture within 1e-4, including the background, and the picture equals that without
    groups.
    """
    scene = bpy.context.scene
    scene.vellus.multiple_scattering = how if how in {"DUAL", "GRID"} else "DUAL"
    if how == "panorama":
        scene.camera.data.type, scene.camera.data.fisheye_fov = "PANO", 0.5
    blur = {"use_motion_blur": how == "motion blur", "motion_steps": 2}
    passes = rendered(tmp_path, **blur, **SIZE)
    groups = groups_of(passes)
    assert groups.keys() == {"Key", "Fill", "Sky", "Unused"} and not groups["Unused"].any()
    total = sum(groups.values())
    np.testing.assert_allclose(total, passes["Combined"][..., :3], atol=1e-4 * total.max())
    assert all(groups[name].any() for name in ("Key", "Fill", "Sky"))
    scene.render.use_motion_blur = False


@pytest.mark.parametrize("kind", share_of(["DUAL", "GRID"], 2))
def test_a_group_is_a_picture_by_its_lights_alone(grouped, tmp_path, kind):
    """The pass of a group equals the picture with all other lights off, of hair and of surfaces, except for noise."""
    scene = bpy.context.scene
    scene.vellus.multiple_scattering = kind
    groups = groups_of(rendered(tmp_path, film_transparent=True, **SIZE))
    light_up((0.0, 0.0, 0.0))
    for name, other in (("Sun", "Lamp"), ("Lamp", "Sun")):
        bpy.data.objects[name].hide_render, bpy.data.objects[other].hide_render = False, True
        alone = rendered(tmp_path, **SIZE)["Combined"][..., :3]
        part = groups["Key" if name == "Sun" else "Fill"]
        limits = (0.04, 0.01) if kind == "DUAL" else (0.25, 0.05)  # paths of the light grid have noise
        np.testing.assert_allclose(part, alone, atol=limits[0] * alone.max())
        assert np.abs(part - alone).mean() < limits[1] * alone.mean()


def test_light_of_no_group_is_only_in_the_picture(grouped, tmp_path):
    """A lamp whose group is not in the view layer is in no pass of a group."""
    bpy.context.scene.vellus.multiple_scattering = "DUAL"
    before = rendered(tmp_path, **SIZE)
    bpy.data.objects["Lamp"].lightgroup = "Elsewhere"
    after = rendered(tmp_path, **SIZE)
    np.testing.assert_array_equal(after["Combined"], before["Combined"])
    now, then = groups_of(after), groups_of(before)
    assert not now["Fill"].any()
    for name in ("Key", "Sky"):
        np.testing.assert_allclose(now[name], then[name], atol=1e-3 * then[name].max())


def test_channels_and_light_are_those_of_cycles(grouped, tmp_path):
    """Each pass has the name that Cycles gives it, and the same light on a matte surface."""
    scene = bpy.context.scene
    grouped.hide_render = True
    matte = bpy.data.materials.new("Matte")
    principled = matte.node_tree.nodes["Principled BSDF"]
    principled.inputs["Roughness"].default_value, principled.inputs["Specular IOR Level"].default_value = 1.0, 0.0
    bpy.data.objects["Sphere"].data.materials.append(matte)
    ours = groups_of(rendered(tmp_path, **SIZE))
    scene.cycles.samples, scene.cycles.device, scene.cycles.use_denoising = 64, "CPU", False
    scene.cycles.pixel_filter_type = "BOX"
    theirs = groups_of(rendered(tmp_path, engine="CYCLES", **SIZE))
    assert ours.keys() == theirs.keys()
    for name in ("Key", "Fill", "Sky"):
        assert ours[name].mean() == pytest.approx(theirs[name].mean(), rel=0.03), name


PANELS = {
    "lamp_light_group": ["lightgroup", "lightgroups"],
    "world_light_group": ["lightgroup", "lightgroups"],
    "light_groups": ["lightgroups", "scene.view_layer_add_lightgroup"],
    "cryptomatte": ["use_pass_cryptomatte_object", "pass_cryptomatte_depth"],
    "passes": ["use_pass_position", "use_pass_object_index", "has_denoising_data"],
}


@pytest.mark.parametrize("name", PANELS)
def test_panels_show_groups_and_passes(grouped, name):
    bpy.context.view_layer.objects.active = bpy.data.objects["Sun"]
    context = SimpleNamespace(
        engine="VELLUS", object=bpy.context.object, world=bpy.context.scene.world, view_layer=bpy.context.view_layer
    )
    panel, shown = getattr(bpy.types, f"VELLUS_PT_{name}"), SimpleNamespace(layout=MagicMock())
    assert panel.poll(context)
    panel.draw(shown, context)
    drawn = {word for _call, words, _more in shown.layout.mock_calls for word in words if isinstance(word, str)}
    assert drawn.issuperset(PANELS[name])
