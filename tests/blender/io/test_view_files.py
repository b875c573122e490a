# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of stereoscopic scenes have a file per view or one for all views, written completely or not at all."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io.pictures import frames, sequence
from hair_addon.core.errors import HairError
from hair_addon.core.files.atomic_file import partial_of
from hair_addon.core.imaging.pixel_sampling import PictureSettings

SMALL = {"width": 16, "height": 12, "sample_count": 1}


@pytest.fixture
def stereo(scene, sphere):
    """Return the scene with a sphere, seen by two eyes."""
    sphere.location.x = 0.3
    bpy.ops.object.light_add(type="SUN")
    bpy.ops.object.camera_add(location=(0.0, -3.0, 0.0), rotation=(np.pi / 2.0, 0.0, 0.0))
    scene.camera = bpy.context.object
    stereo = scene.camera.data.stereo
    stereo.convergence_mode, stereo.interocular_distance = "PARALLEL", 0.5
    scene.render.use_multiview = True
    return scene


def there(folder):
    return sorted(path.name for path in folder.iterdir())


def pixels(path):
    image = bpy.data.images.load(str(path))
    values = np.array(image.pixels[:], np.float32).reshape(SMALL["height"], SMALL["width"], 4)
    bpy.data.images.remove(image)
    return values


def column(picture):
    """Return the sphere's column in the picture, from the left [pixels]."""
    covered = picture[..., 3].sum(axis=0)
    return (covered * np.arange(len(covered))).sum() / covered.sum()


@pytest.mark.parametrize("engine", ["vellus", "cycles"])
def test_each_eye_has_its_picture(stereo, tmp_path, engine):
    stereo.render.image_settings.views_format = "INDIVIDUAL"
    api.render(tmp_path / "a_##.png", frame=3, engine=engine, is_transparent=True, **SMALL)
    assert there(tmp_path) == ["a_03_L.png", "a_03_R.png"]
    left, right = (column(pixels(tmp_path / name)) for name in there(tmp_path))
    assert left > right + 0.5  # as the left eye is to the left of the sphere


@pytest.mark.parametrize(
    ("chosen", "name", "is_one"),
    [
        ("STEREO_3D", "a.png", True),
        ("STEREO_3D", "a.exr", True),
        ("MULTIVIEW", "a.exr", True),
        ("MULTIVIEW", "a.png", False),
    ],
)
@pytest.mark.parametrize("has_passes", [False, True])
def test_views_share_a_file_where_its_format_can(stereo, tmp_path, chosen, name, is_one, has_passes):
    image = stereo.render.image_settings
    image.file_format = "OPEN_EXR" if chosen == "MULTIVIEW" else "PNG"
    image.views_format = chosen
    has_passes = has_passes and name.endswith(".exr")
    api.render(tmp_path / name, engine="cycles", has_passes=has_passes, **SMALL)
    assert there(tmp_path) == ([name] if is_one else ["a_L.png", "a_R.png"])
    assert image.views_format == chosen


def test_one_view_has_its_suffix(stereo, tmp_path):
    stereo.render.views["left"].use = False
    api.render(tmp_path / "a.png", engine="cycles", **SMALL)
    assert there(tmp_path) == ["a_R.png"]


def test_a_frame_is_done_when_all_its_views_are(stereo, tmp_path):
    stereo.render.image_settings.views_format = "INDIVIDUAL"
    pattern, settings, numbers = tmp_path / "f_#.png", PictureSettings(**SMALL), [1, 2]
    sequence.begin(pattern, numbers, {"sequence": 1})

    def write(path, number):
        frames.write_frame(path, number, "cycles", settings, partial_of(path))

    def made():
        return [number for number, _path in sequence.make(pattern, numbers, write)]

    assert made() == [1, 2] and made() == []
    whole = there(tmp_path)
    assert {"f_1_L.png", "f_1_R.png", "f_2_L.png", "f_2_R.png"} < {*whole}
    (tmp_path / "f_2_R.png").unlink()
    left_behind = partial_of(tmp_path / "f_1_L.png")
    left_behind.write_bytes(b"of a process that was killed")
    assert made() == [2] and there(tmp_path) == whole
    sequence.begin(pattern, numbers, {"sequence": 2}, replaces=True)
    assert not [name for name in there(tmp_path) if name.endswith(".png")]


def test_views_of_one_name_are_refused(stereo, tmp_path):
    stereo.render.image_settings.views_format = "INDIVIDUAL"
    stereo.render.views["left"].file_suffix = "_R"
    with pytest.raises(HairError, match="need file suffixes that differ"):
        api.render(tmp_path / "a.png", engine="cycles", **SMALL)
    assert there(tmp_path) == []
