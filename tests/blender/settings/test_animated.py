# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyed settings: hair in a frame is what its settings say there, in the viewport and in a render."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import pipeline
from hair_addon.blender.materials import looks, materials
from hair_addon.core.shading import appearance
from tests.support.guide_tools import grown_from_nothing, lengths_of
from tests.support.reading import points


@pytest.fixture
def keyed_hair(hair):
    """100 black strands in frame 1, 300 light ones in frame 11."""
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
    monkeypatch.setattr(pipeline, "interpolate_hair", lambda *args: made.append("hair"))
    monkeypatch.setattr(looks, "evaluate_shading", lambda *args: made.append("shading"))
    scene = bpy.context.scene
    scene.frame_set(20)
    assert made == ["hair", "shading"]
    scene.frame_set(30)
    assert made == ["hair", "shading"]
    keyed_hair.data.animation_data_clear()
    scene.frame_set(6)
    assert made == ["hair", "shading"]


def test_an_animation_renders_as_its_frames_do(keyed_hair, tmp_path):
    """A render has a dependency graph of its own, and leaves the file's own values alone."""
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
