# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced light among strands gives pictures with known colors."""

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.blender.render import light_paths
from hair_addon.core.shading import presets
from hair_addon.core.shading.light_paths import gather, strand_nodes

WHITE = replace(
    presets.PRESETS["WHITE"][1],
    parametrization="ABSORPTION",
    absorption=(0.0, 0.0, 0.0),
    random_color=0.0,
    roughness=0.3,
)
BROWN = replace(presets.PRESETS["BROWN"][1], random_color=0.0, roughness=0.3)


def hair_of(scene, middles, look, length=0.5, radius=0.004, model="MARSCHNER", mode="energy"):
    """Add upright strands around middles (S, 3)."""
    points = middles[:, None] + np.linspace(-0.5, 0.5, 9)[:, None] * np.array([0.0, 0.0, length])
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([9] * len(points))
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = np.full(9 * len(points), radius, np.float32)
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    scene.collection.objects.link(bpy.data.objects.new("Hair", curves))
    curves.vellus.kind = "HAIR"
    api.shade(curves, look, model=model, mode=mode)
    return curves


def light(scene, world=0.0, sun=0.0):
    scene.world = bpy.data.worlds.new("World")
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (world, world, world, 1.0)
    if sun:
        lamp = bpy.data.lights.new("Sun", "SUN")
        lamp.energy, lamp.angle = sun, 0.0
        placed = bpy.data.objects.new("Sun", lamp)
        placed.rotation_euler = Vector((-0.4, -1.0, 0.5)).to_track_quat("Z", "Y").to_euler()
        scene.collection.objects.link(placed)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 1.6
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = 0.0, -4.0, 0.0
    scene.camera.rotation_euler = np.pi / 2, 0.0, 0.0
    scene.collection.objects.link(scene.camera)


def picture(scene, scattering):
    scene.vellus.multiple_scattering = scattering
    bpy.context.view_layer.update()
    return api.draw(width=64, height=64, samples_per_side=2, is_transparent=True)


def mean_color(drawn):
    return drawn[..., :3].sum(axis=(0, 1)) / drawn[..., 3].sum()


def test_scenes_without_a_setting_take_the_light_grid(scene, rng):
    """Scenes without the setting use the light grid, and stored values keep their meaning."""
    hair_of(scene, rng.uniform(-0.5, 0.5, (50, 3)), BROWN)
    light(scene, world=0.3, sun=2.0)
    dual, wanted = (picture(scene, scattering) for scattering in ("DUAL", "GRID"))
    assert not np.array_equal(dual, wanted)
    scene.vellus.property_unset("multiple_scattering")
    drawn = api.draw(width=64, height=64, samples_per_side=2, is_transparent=True)
    np.testing.assert_array_equal(drawn, wanted)
    stored = {item.identifier: item.value for item in scene.vellus.bl_rna.properties["multiple_scattering"].enum_items}
    assert stored == {"DUAL": 0, "GRID": 1}


def test_white_hair_in_a_white_world_is_white(scene, rng):
    hair_of(scene, rng.uniform(-0.5, 0.5, (600, 3)), WHITE)
    light(scene, world=0.8)
    drawn = picture(scene, "GRID")
    np.testing.assert_allclose(mean_color(drawn), 0.8, rtol=0.01)
    inside = drawn[..., 3] > 0.9
    np.testing.assert_allclose(drawn[inside][:, :3] / drawn[inside][:, 3:], 0.8, rtol=0.05)


def test_strands_far_from_each_other_are_as_with_dual_scattering(scene, monkeypatch):
    """Strands far from each other are as bright as with dual scattering, with enough paths for a noise of 1 %."""
    monkeypatch.setattr(light_paths, "_LEAST_PATHS", 150_000)
    x = np.linspace(-0.6, 0.6, 5)
    hair_of(scene, np.stack([x, 0.0 * x, 0.0 * x], axis=-1), BROWN)
    light(scene, sun=3.0)
    scene.camera.rotation_euler.y = 0.3  # upright strands cross the columns of samples
    found, expected = (mean_color(picture(scene, scattering)) for scattering in ("GRID", "DUAL"))
    np.testing.assert_allclose(found, expected, rtol=0.04)


def test_strands_have_the_light_of_their_own_nodes(scene, monkeypatch):
    """Each strand has the light of its own sample points, from root to tip."""
    x = np.linspace(-0.6, 0.6, 5)
    hair_of(scene, np.stack([x, 0.0 * x, 0.0 * x], axis=-1), BROWN, radius=0.03)
    light(scene, sun=3.0)
    values = []

    def texels(nodes, system, *_ratios):
        of = nodes._systems[system]
        strand, node = np.indices((of.strand_count, of.node_count))
        light = np.zeros((*strand.shape, 4), np.float32)
        light[..., :3] = values[-1](strand, (node + 0.5) / of.node_count)[..., None]
        return light

    monkeypatch.setattr(strand_nodes.NodeSums, "texels", texels)
    drawn = []
    for value in (lambda strand, along: 1.0 + 0.0 * strand * along, lambda strand, along: 1.0 + strand + 10.0 * along):
        values.append(value)
        drawn.append(picture(scene, "GRID")[..., :3].sum(axis=-1).reshape(64, 64))
    even, changed = drawn
    column = (32.0 + x / 1.6 * 64.0).astype(int)
    rows = np.arange(24, 40)  # the middle of the strands
    found = changed[rows][:, column] / even[rows][:, column]
    height = ((rows + 0.5) / 64.0 - 0.5) * 1.6 / 0.5 + 0.5
    expected = 1.0 + np.arange(5) + 10.0 * height[:, None]
    np.testing.assert_allclose(found, expected, rtol=0.04)


@pytest.mark.parametrize("shading", [{"mode": "classic"}, {"model": "KAJIYA_KAY"}])
def test_other_models_take_dual_scattering(scene, rng, shading):
    hair_of(scene, rng.uniform(-0.5, 0.5, (50, 3)), BROWN, **shading)
    light(scene, world=0.3, sun=2.0)
    np.testing.assert_array_equal(picture(scene, "GRID"), picture(scene, "DUAL"))


def test_hair_without_any_area_takes_dual_scattering(scene, rng):
    hair_of(scene, rng.uniform(-0.5, 0.5, (50, 3)), BROWN, radius=0.0)
    light(scene, world=0.3, sun=2.0)
    np.testing.assert_array_equal(picture(scene, "GRID"), picture(scene, "DUAL"))


def test_hair_that_is_too_large_for_its_width_takes_dual_scattering(scene, monkeypatch):
    """Hair that is too large for its width uses dual scattering, as places are rounded by a thousand times its
    width.
    """
    monkeypatch.setattr(gather, "gather", None)
    middles = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 1e8, 0.0]])
    hair_of(scene, middles, BROWN)
    light(scene, world=0.3, sun=2.0)
    np.testing.assert_array_equal(picture(scene, "GRID"), picture(scene, "DUAL"))


def test_a_thick_ring_covers_its_area(scene):
    """A thick ring covers its area with half disks at its ends, also where it turns from rows to columns."""
    turn = np.linspace(0.3, 2.0 * np.pi - 0.3, 65)
    points = np.stack([0.5 * np.cos(turn), 0.0 * turn, 0.5 * np.sin(turn)], axis=-1)
    curves = bpy.data.hair_curves.new("Ring")
    curves.add_curves([65])
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(65, 0.1, np.float32))
    scene.collection.objects.link(bpy.data.objects.new("Ring", curves))
    curves.vellus.kind = "HAIR"
    light(scene, world=0.5)
    drawn = picture(scene, "DUAL")
    area = np.ptp(turn) * 0.5 * 0.2 + np.pi * 0.1**2
    assert drawn[..., 3].sum() * (1.6 / 64) ** 2 == pytest.approx(area, rel=0.01)


@pytest.mark.parametrize("device", ["cpu", "cuda"])
def test_steps_of_motion_blur_share_the_paths_of_a_frame(device):
    """A frame of any number of steps has at most the paths of a still one, to a path per step."""
    device, count = SimpleNamespace(is_cpu=device == "cpu"), 300_000
    still = light_paths.most_paths(device, count)
    for steps in (2, 5, 8, 64):
        assert steps * light_paths.most_paths(device, -(-count // steps), steps) <= still + 4 * steps


def test_each_step_of_a_blurred_render_gets_its_share(scene, rng, monkeypatch):
    """The number of steps reaches the tracing of each step."""
    hair_of(scene, rng.uniform(-0.5, 0.5, (50, 3)), BROWN)
    light(scene, sun=2.0)
    scene.render.engine, scene.render.resolution_percentage = "VELLUS", 100
    scene.render.resolution_x, scene.render.resolution_y, scene.vellus.sample_count = 32, 32, 4
    scene.vellus.multiple_scattering, scene.render.use_motion_blur, scene.vellus.motion_steps = "GRID", True, 3
    found, real = [], light_paths.most_paths
    monkeypatch.setattr(light_paths, "most_paths", lambda _device, *given: found.append(given) or real(_device, *given))
    bpy.ops.render.render()
    assert found == [(-(-light_paths.path_count(scene, (32, 32)) // 3), 3)] * 3
