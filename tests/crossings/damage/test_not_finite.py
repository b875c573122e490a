# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights, cameras, objects and worlds with non-finite numbers are left out of pictures and reported once."""

import math

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.host import notices
from tests.support.dynamics.following import update

SMALL = {"width": 24, "height": 18}
NAN, INF = math.nan, math.inf


@pytest.fixture(autouse=True)
def nothing_said():
    notices.printed_cache.clear()


def lamp(kind, owner, name, value):
    """Add a light for non-finite values."""

    def make():
        light = bpy.data.lights.new("Bad", kind)
        bad = bpy.data.objects.new("Bad", light)
        bad.location = (0.0, -3.0, 1.0)
        bpy.context.scene.collection.objects.link(bad)
        setattr(light if owner == "data" else bad, name, value)

    return make


def mesh_object(name, value):
    def make():
        bad = bpy.data.objects.new("Bad", bpy.data.meshes["Icosphere"])
        bpy.context.scene.collection.objects.link(bad)
        setattr(bad, name, value)

    return make


def more_hair(name, value):
    def make():
        bad = bpy.data.objects["Hair"].copy()  # of the same Curves
        bad.name = "Bad"
        bpy.context.scene.collection.objects.link(bad)
        setattr(bad, name, value)

    return make


LEFT_OUT = {
    "energy": lamp("POINT", "data", "energy", INF),
    "energy of a sun": lamp("SUN", "data", "energy", NAN),
    "exposure": lamp("POINT", "data", "exposure", NAN),
    "color": lamp("SPOT", "data", "color", (NAN, 0.0, 0.0)),
    "size": lamp("AREA", "data", "size", INF),
    "radius": lamp("POINT", "data", "shadow_soft_size", NAN),
    "cone": lamp("SPOT", "data", "spot_size", NAN),
    "angle": lamp("SUN", "data", "angle", NAN),
    "rotation of a sun": lamp("SUN", "object", "rotation_euler", (NAN, 0.0, 0.0)),
    "scale of an area": lamp("AREA", "object", "scale", (INF, 1.0, 1.0)),
    "scale of a sun to nothing": lamp("SUN", "object", "scale", (0.0, 0.0, 0.0)),
    "location": lamp("POINT", "object", "location", (NAN, 0.0, 0.0)),
    "a far location": lamp("POINT", "object", "location", (INF, 0.0, 0.0)),
    "scale of a mesh": mesh_object("scale", (NAN, 1.0, 1.0)),
    "location of a mesh": mesh_object("location", (0.0, INF, 0.0)),
    "location of hair": more_hair("location", (NAN, 0.0, 0.0)),
    "scale of hair": more_hair("scale", (1.0, INF, 1.0)),
}


def rendered(folder):
    path = api.render(folder / "a.exr", sample_count=1, **SMALL)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels[:], np.float32)
    bpy.data.images.remove(image)
    return pixels


def test_non_finite_data_is_skipped_and_reported_once(lit, capfd):
    expected = api.draw(samples_per_side=1, **SMALL)
    assert expected[..., :3].max() > 0.0
    for make in LEFT_OUT.values():
        make()
    update()
    bad = [o.name for o in bpy.data.objects if o.name.startswith("Bad")]
    assert len(bad) == len(LEFT_OUT)
    for _time in range(2):
        np.testing.assert_array_equal(api.draw(samples_per_side=1, **SMALL), expected)
    reported = capfd.readouterr().err
    assert [reported.count(f"{name!r} is skipped") for name in bad] == [1] * len(bad) and "Traceback" not in reported


@pytest.mark.parametrize("name", ["energy", "rotation of a sun", "location of a mesh", "location of hair"])
def test_the_render_engine_leaves_it_out_too(lit, name, tmp_path, capfd):
    expected = rendered(tmp_path)
    LEFT_OUT[name]()
    update()
    np.testing.assert_array_equal(rendered(tmp_path), expected)
    reported = capfd.readouterr()
    assert "'Bad' is skipped" in reported.err and "Traceback" not in reported.err + reported.out


def test_a_point_light_that_is_scaled_to_nothing_shines(lit):
    dark = api.draw(samples_per_side=1, **SMALL)
    lamp("POINT", "object", "scale", (0.0, 0.0, 0.0))()
    bpy.data.objects["Bad"].data.energy = 500.0
    update()
    assert api.draw(samples_per_side=1, **SMALL).sum() > dark.sum()


@pytest.mark.parametrize("value", [NAN, INF])
def test_a_world_without_finite_numbers_is_black(lit, value, capfd):
    expected = api.draw(samples_per_side=1, **SMALL)
    world = bpy.context.scene.world = bpy.data.worlds.new("Bad")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = value
    np.testing.assert_array_equal(api.draw(samples_per_side=1, **SMALL), expected)
    assert "'Bad' is skipped" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        ("object", "location", (NAN, 0.0, 0.0)),
        ("object", "location", (INF, 0.0, 0.0)),
        ("object", "rotation_euler", (NAN, 0.0, 0.0)),
        ("data", "lens", NAN),
        ("data", "shift_x", NAN),
        ("data", "clip_end", NAN),
    ],
)
def test_a_non_finite_camera_is_reported(lit, owner, name, value, tmp_path, capfd):
    camera = bpy.context.scene.camera
    setattr(camera.data if owner == "data" else camera, name, value)
    update()
    for draw in (lambda: api.draw(samples_per_side=1, **SMALL), lambda: api.render(tmp_path / "a.exr", **SMALL)):
        with pytest.raises(api.HairError, match='"Camera"'):
            draw()
    reported = capfd.readouterr()
    assert "Traceback" not in reported.err + reported.out and not [*tmp_path.iterdir()]


def test_hair_that_was_scaled_to_a_point_leaves_a_picture(lit, tmp_path):
    curves = bpy.data.objects["Hair"].data
    points = curves.attributes["position"].data
    points.foreach_set("vector", np.full(3 * len(points), 0.2, np.float32))
    curves.update_tag()
    update()
    assert np.isfinite(rendered(tmp_path)).all()
