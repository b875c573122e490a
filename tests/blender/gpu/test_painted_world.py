# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair is lit by the current pixels of the world's image, however they were changed."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.gpu import lights, world_texture
from hair_addon.blender.live import events, invalidation
from hair_addon.core.errors import HairError
from tests.blender.gpu.test_world_texture import environment_node
from tests.support.pictures.rendering import rendered

SIZE = (16, 8)
GREY, BLUE = (0.5, 0.5, 0.5, 1.0), (0.05, 0.1, 0.9, 1.0)


def fill(image, color):
    image.pixels.foreach_set(np.tile(np.float32(color), len(image.pixels) // 4))
    image.update()


def saved(folder, color, name="sky.exr"):
    """Return the path of an image of one color."""
    image = bpy.data.images.new("Saved", *SIZE, float_buffer=True)
    fill(image, color)
    image.filepath_raw, image.file_format = str(folder / name), "OPEN_EXR"
    image.save()
    bpy.data.images.remove(image)
    return str(folder / name)


def generated(_folder):
    return bpy.data.images.new("Sky", *SIZE)


def painted(folder, is_float=True):
    image = bpy.data.images.new("Sky", *SIZE, float_buffer=is_float)
    fill(image, GREY)
    return image


def packed(folder):
    image = painted(folder)
    image.pack()
    return image


def loaded(folder):
    return bpy.data.images.load(saved(folder, GREY))


def recolor(image, _folder):
    image.generated_color = BLUE


def paint(image, _folder):
    fill(image, BLUE)


def paint_and_pack(image, _folder):
    fill(image, BLUE)
    image.pack()


def paint_and_save(image, _folder):
    fill(image, BLUE)
    image.save()


def reload(image, folder):
    saved(folder, BLUE)
    image.reload()


WAYS = [
    (painted, paint),
    (lambda folder: painted(folder, is_float=False), paint),
    (packed, paint_and_pack),
    (generated, recolor),
    (loaded, paint_and_save),
    (loaded, reload),
]
NAMES = ["float", "byte", "packed", "generated", "saved", "reloaded"]


@pytest.fixture
def dark(lit):
    """Return a scene with a little hair and a camera, without light."""
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 50, 0.02
    bpy.context.view_layer.update()
    for light in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    return bpy.context.scene


def drawn(**_settings):
    return api.draw(width=32, height=24, samples_per_side=1, is_transparent=True)


@pytest.mark.parametrize(("make", "change"), WAYS, ids=NAMES)
def test_a_picture_is_lit_by_the_image_of_now(dark, tmp_path, make, change):
    image = make(tmp_path)
    environment_node(dark, image)
    before = drawn()
    change(image, tmp_path)
    after = drawn()
    invalidation.clear()
    np.testing.assert_array_equal(after, drawn())
    assert np.abs(after - before)[..., :3].max() > 0.02


@pytest.mark.parametrize(("make", "change"), [WAYS[0], WAYS[3], WAYS[5]], ids=["float", "generated", "reloaded"])
def test_viewports_are_lit_by_the_image_of_now(dark, tmp_path, make, change):
    """Viewports read the world's image again when Blender has reported a change."""
    image = make(tmp_path)
    environment_node(dark, image)
    bpy.context.view_layer.update()
    _lobes, before = world_texture.light_of(lights.read_world(dark))
    change(image, tmp_path)
    bpy.context.view_layer.update()
    _lobes, after = world_texture.light_of(lights.read_world(dark))
    assert not np.allclose(before, after)


def test_an_image_that_could_not_be_read_is_read_again(dark, tmp_path, monkeypatch):
    """An image that could not be read is read again, and its former light does not remain."""
    image = packed(tmp_path)
    environment_node(dark, image)
    _lobes, before = world_texture.light_of(lights.read_world(dark))
    paint_and_pack(image, tmp_path)
    events.image_changed()

    def fail(_world):
        raise HairError("The world's image cannot be read.")

    with monkeypatch.context() as patch:
        patch.setattr(world_texture, "_unrolled", fail)
        with pytest.raises(HairError):
            world_texture.light_of(lights.read_world(dark))
    _lobes, after = world_texture.light_of(lights.read_world(dark))
    assert not np.allclose(before, after)


def test_renders_are_lit_by_the_image_of_now(dark, tmp_path):
    image = packed(tmp_path)
    environment_node(dark, image)
    before = rendered(tmp_path, film_transparent=True)["Combined"]
    paint_and_pack(image, tmp_path)
    assert np.abs(rendered(tmp_path, film_transparent=True)["Combined"] - before)[..., :3].max() > 0.02


def test_an_image_that_is_the_same_is_taken_apart_once(dark, tmp_path, monkeypatch):
    environment_node(dark, packed(tmp_path))
    drawn()
    monkeypatch.setattr(world_texture, "_unrolled", None)
    drawn()


def test_a_sequence_shows_the_frame_of_the_scene(dark, tmp_path):
    """An image sequence lights hair with the image of the scene's frame, by the node's first frame, length and
    offset.
    """
    colors = {number: (0.1 * number, 0.2, 0.3, 1.0) for number in (1, 2, 3)}
    for number, color in colors.items():
        saved(tmp_path, color, f"sky_{number:04}.exr")
    image = bpy.data.images.load(str(tmp_path / "sky_0001.exr"))
    image.source = "SEQUENCE"
    user = environment_node(dark, image).image_user
    user.frame_duration, user.frame_start, user.use_auto_refresh = 2, 10, True
    for offset, is_cyclic, frame, shown in (
        (0, False, 10, 1),
        (0, False, 11, 2),
        (0, False, 15, 2),
        (0, True, 12, 1),
        (1, False, 10, 2),
        (1, False, 11, 3),
    ):
        user.frame_offset, user.use_cyclic = offset, is_cyclic
        dark.frame_set(frame)
        lobes, sides = world_texture.light_of(lights.read_world(dark))
        assert not lobes
        np.testing.assert_allclose(sides, np.broadcast_to(colors[shown][:3], (6, 3)), rtol=2e-3, err_msg=str(frame))


def test_an_unloaded_world_image_lights_hair(dark, tmp_path):
    """An image that is not loaded, as in a file just opened in background mode, lights hair."""
    environment_node(dark, loaded(tmp_path))
    before = drawn()
    assert np.abs(before[..., :3]).max() > 0.1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "sky.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "sky.blend"))
    np.testing.assert_allclose(drawn(), before, atol=1e-5)
