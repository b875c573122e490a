# SPDX-License-Identifier: GPL-3.0-or-later
"""Animated settings: hair matches the settings of each frame, in viewports and renders."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import pipeline
from hair_addon.blender.live import handlers
from hair_addon.blender.materials import looks, materials
from hair_addon.blender.settings import ramp_nodes
from hair_addon.core.shading import appearance
from tests.support.guide_tools import grown_from_nothing, lengths_of
from tests.support.pictures import render_probe
from tests.support.reading import points


@pytest.fixture
def keyed_hair(hair):
    """Return 100 black strands in frame 1 and 300 light strands in frame 11."""
    state = hair.data.vellus
    for frame, count, melanin in ((1, 100, 0.9), (11, 300, 0.1)):
        state.hair.strand_count, state.appearance.melanin = count, melanin
        hair.data.keyframe_insert("vellus.hair.strand_count", frame=frame)
        hair.data.keyframe_insert("vellus.appearance.melanin", frame=frame)
    bpy.context.scene.frame_set(1)
    return hair


def absorption(hair):
    nodes = hair.data.materials[0].node_tree.nodes
    node = next(node for node in nodes if node.bl_idname == materials.HAIR_NODE)
    sockets = {socket.identifier: socket.default_value for socket in node.inputs}
    return np.array(sockets["Absorption Coefficient"])


@pytest.mark.parametrize("frame, count, melanin", [(1, 100, 0.9), (6, 200, 0.5), (11, 300, 0.1)])
def test_hair_follows_animated_settings_in_each_frame(keyed_hair, frame, count, melanin):
    bpy.context.scene.frame_set(frame)
    assert len(keyed_hair.data.curves) == count
    look = appearance.Appearance(melanin=melanin)
    wanted = appearance.principled_sockets(look)["Absorption Coefficient"]
    np.testing.assert_allclose(absorption(keyed_hair), wanted, rtol=1e-5)


def test_keyed_guides_grow_again_and_hair_follows_them(hair):
    guides = bpy.data.objects["Guides"]
    for frame, length in ((1, 0.5), (11, 0.1)):
        guides.data.vellus.guides.length = length
        guides.data.keyframe_insert("vellus.guides.length", frame=frame)
    for frame, length in ((1, 0.5), (6, 0.3), (11, 0.1)):
        bpy.context.scene.frame_set(frame)
        assert lengths_of(points(guides)).mean() == pytest.approx(length, rel=0.05)  # they vary
        np.testing.assert_array_equal(points(hair), grown_from_nothing(hair))


def test_a_frame_is_the_same_whichever_came_before(keyed_hair):
    scene = bpy.context.scene
    first = points(keyed_hair)
    for frame in (11, 4, 1):
        scene.frame_set(frame)
    np.testing.assert_array_equal(points(keyed_hair), first)


def test_unanimated_hair_is_not_regenerated(keyed_hair, monkeypatch):
    made = []

    def shade(shaded, *_args):
        made.append("shading")
        shaded.vellus.is_shading_stale = False

    monkeypatch.setattr(pipeline, "interpolate_hair", lambda *args: made.append("hair"))
    monkeypatch.setattr(looks, "evaluate_shading", shade)
    scene = bpy.context.scene
    scene.frame_set(20)
    assert made == ["hair", "shading"]
    scene.frame_set(30)
    assert made == ["hair", "shading"]
    keyed_hair.data.animation_data_clear()
    scene.frame_set(6)
    assert made == ["hair", "shading"]


def test_an_animation_renders_as_its_frames_do(keyed_hair, tmp_path):
    """An animation renders as its frames do, with a dependency graph of its own, and leaves the file's values alone."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.render.film_transparent = True
    bpy.ops.object.light_add(type="SUN")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 5.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 5
    scene.render.filepath = str(tmp_path / "all_")
    bpy.ops.render.render(animation=True)
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        scene.render.filepath = str(tmp_path / f"one_{frame:04d}.png")
        bpy.ops.render.render(write_still=True)
    every, alone = ([pixels(tmp_path / f"{name}_{frame:04d}.png") for frame in (1, 6, 11)] for name in ("all", "one"))
    np.testing.assert_array_equal(every, alone)
    assert not np.array_equal(every[0], every[1]) and not np.array_equal(every[1], every[2])


def pixels(path):
    image = bpy.data.images.load(str(path))
    return np.array(image.pixels[:])


def drive(hair, path, expression="0.01 * x"):
    """Drive a setting by a property of the surface whose value is 2."""
    surface = bpy.data.objects["Sphere"]
    surface["x"] = 2.0
    surface.update_tag()
    driver = hair.data.driver_add(path).driver
    variable = driver.variables.new()
    variable.name, variable.targets[0].id, variable.targets[0].data_path = "x", surface, '["x"]'
    driver.expression = expression


def root_radius(hair):
    return hair.data.attributes["radius"].data[0].value


@pytest.mark.parametrize("path, expression", [("vellus.hair.radius", "0.01 * x"), ("vellus.hair.thickness", "20 * x")])
def test_the_first_value_of_a_driver_counts(hair, path, expression):
    drive(hair, path, expression)
    bpy.context.view_layer.update()
    assert root_radius(hair) == pytest.approx(0.02)
    bpy.data.objects["Sphere"]["x"] = 3.0
    bpy.data.objects["Sphere"].update_tag()
    bpy.context.view_layer.update()
    assert root_radius(hair) == pytest.approx(0.03)


@pytest.mark.parametrize("path", ["vellus.styles[0].trim.factor", 'vellus.styles["Trim"].trim.factor'])
def test_so_does_that_of_a_style_s_driver(hair, path):
    api.set_styles(hair, [api.Trim(factor=1.0)])
    bpy.context.view_layer.update()
    long = lengths_of(points(hair))
    drive(hair, path, "0.25 * x")
    bpy.context.view_layer.update()
    np.testing.assert_allclose(lengths_of(points(hair)), 0.5 * long, rtol=0.02)


@pytest.fixture
def rendered():
    """Return a function that renders a frame: (N, 3) points of the hair that the render reads, and their radii."""

    def read(depsgraph):
        shown = depsgraph.objects["Hair"].data
        radii = np.empty(len(shown.points), np.float32)
        shown.attributes["radius"].data.foreach_get("value", radii)
        return curves.read_points(shown), radii

    with render_probe.reading(read) as render:
        yield lambda frame: render(frames=(frame, frame, 1))[0]


def test_what_a_script_keys_and_drives_is_in_its_first_render(hair, rendered):
    """A script's keys and drivers act in its first render without an update, as Blender changes the frame before it
    renders.
    """
    drive(hair, "vellus.hair.radius")
    for frame, length in ((1, 0.2), (11, 0.4)):
        bpy.data.objects["Guides"].data.vellus.guides.length = length
        bpy.data.objects["Guides"].data.keyframe_insert("vellus.guides.length", frame=frame)
    strands, radii = rendered(11)
    assert lengths_of(strands.reshape(points(hair).shape)).mean() == pytest.approx(0.4, rel=0.05)
    assert radii[0] == pytest.approx(0.02)


def test_each_frame_of_a_render_has_the_hair_of_its_keyed_guides(hair):
    guides = bpy.data.objects["Guides"].data
    for frame, length in ((1, 0.2), (11, 0.4)):
        guides.vellus.guides.length = length
        guides.keyframe_insert("vellus.guides.length", frame=frame)
    frames, shape = (6, 12, 3), points(hair).shape
    with render_probe.reading(lambda depsgraph: curves.read_points(depsgraph.objects["Hair"].data)) as render:
        found = [lengths_of(strands.reshape(shape)).mean() for strands in render(frames=frames)]
    for length, frame in zip(found, range(frames[0], frames[1] + 1, frames[2]), strict=True):
        bpy.context.scene.frame_set(frame)
        assert length == pytest.approx(lengths_of(points(hair)).mean(), rel=1e-4)
    assert found == sorted(found) and found[-1] > 1.2 * found[0]


def test_a_driver_that_a_file_has_computes_nothing_again_when_it_is_opened(hair, tmp_path, monkeypatch):
    drive(hair, "vellus.hair.radius")
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "driven.blend"))
    monkeypatch.setattr(pipeline, "interpolate_hair", lambda *args: pytest.fail("hair is computed again"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "driven.blend"))
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(2)


def test_what_a_script_sets_before_a_window_shows_its_file_is_in_the_hair(hair, monkeypatch):
    """Settings that a script writes before a window shows its file are in the hair, as the first update in a window
    reports everything.
    """
    monkeypatch.setattr(handlers, "_is_opening", True)
    hair.data.vellus.hair.radius = 0.025
    drive(hair, "vellus.appearance.melanin", "0.1 * x")
    bpy.context.view_layer.update()
    assert not handlers._is_opening
    assert root_radius(hair) == pytest.approx(0.025)
    wanted = appearance.principled_sockets(appearance.Appearance(melanin=0.2))["Absorption Coefficient"]
    np.testing.assert_allclose(absorption(hair), wanted, rtol=1e-5)


def test_keyed_maps_vary_the_hair_of_each_frame_and_keep_their_keys(hair):
    """Keys of a map follow it when a map before it in the list is removed."""
    api.set_map(hair, "strands.thickness", "strand", low=0.5)
    api.set_map(hair, "strands.strand_length", "strand", low=1.0)
    item = hair.data.vellus.maps[1]
    for frame, low in ((1, 1.0), (11, 0.2)):
        item.low = low
        item.keyframe_insert("low", frame=frame)
    bpy.context.scene.frame_set(1)
    long = lengths_of(points(hair))
    api.clear_map(hair, "strands.thickness")
    bpy.context.scene.frame_set(11)
    parts = lengths_of(points(hair)) / long
    assert hair.data.vellus.maps[0].low == pytest.approx(0.2)
    assert parts.min() < 0.25 and parts.mean() == pytest.approx(0.6, abs=0.1)


def test_keyed_color_ramps_color_the_hair_of_each_frame_and_render(hair):
    """A stop of a map's color ramp is keyed from red to blue; a render leaves the viewport's frame as it was."""
    hair.data.vellus.appearance.parametrization = "COLOR"
    api.set_map(hair, "look.color", "strand", ramp="0:1/0/0")
    node = ramp_nodes.node_of(hair.data.vellus.maps[0].ramp_tree)
    for frame, color in ((1, (1.0, 0.0, 0.0, 1.0)), (11, (0.0, 0.0, 1.0, 1.0))):
        node.color_ramp.elements[0].color = color
        node.color_ramp.elements[0].keyframe_insert("color", frame=frame)

    def shown(curves_data):
        return strand_maps.read_looks(curves_data).root

    def wanted(color):
        look = appearance.Appearance(parametrization="COLOR", color=color)
        return np.tile(np.float32(appearance.sigma_a(look)), (len(hair.data.curves), 1))

    for frame, color in ((2, (0.972, 0.0, 0.028)), (6, (0.5, 0.0, 0.5))):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(shown(hair.data), wanted(color), rtol=1e-4)
    with render_probe.reading(lambda depsgraph: shown(depsgraph.objects["Hair"].data)) as render:
        np.testing.assert_allclose(render(frames=(11, 11, 1))[0], wanted((0.0, 0.0, 1.0)), rtol=1e-4)
    np.testing.assert_allclose(shown(hair.data), wanted((0.5, 0.0, 0.5)), rtol=1e-4)
