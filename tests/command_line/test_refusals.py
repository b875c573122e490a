# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line and scripts refuse invalid names, faces, frames and output early, with one message."""

import math
import os
import subprocess

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene as scene_data
from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file
from hair_addon.core.imaging.pixel_sampling import FIRST_FRAME, LAST_FRAME
from tests.command_line.test_hostile_files import SMALL, mesh, refuse  # noqa: F401 (a fixture)
from tests.support.commands import PYTHONPATH, TETRAHEDRON, command, run_here, write_obj

LONG = "x" * 300


def sentence(*words):
    """Return the message of a command that fails with one sentence and leaves no files."""
    ended = run_here(*words)
    assert ended.status == 1 and ended.out == "" and len(ended.errors.splitlines()) == 1, ended.errors
    return ended.errors


# Files.


@pytest.mark.parametrize("verb", ["groom", "info"])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("faceVertexIndices = [0, 2, 1,", "faceVertexIndices = [0, 2, 99999999,"),
        ("faceVertexIndices = [0, 2, 1,", "faceVertexIndices = [0, 2, -1,"),
        ("faceVertexCounts = [3,", "faceVertexCounts = [1000000000,"),
        ("faceVertexCounts = [3, 3,", "faceVertexCounts = [-3, 9,"),
        ("int[] faceVertexIndices = [", "int faceVertexIndices = 3\n        int[] others = ["),
        ("def Mesh", "def \xff\xfe"),
    ],
)
def test_a_damaged_usd_is_one_sentence(mesh, verb, old, new):  # noqa: F811
    path = mesh("mesh.usda")
    content = path.read_bytes()
    assert old.encode() in content
    path.write_bytes(content.replace(old.encode(), new.encode("latin-1"), 1))
    refuse(path, str(path), verb=verb)


def disk_file(scene, folder, corner_count):
    """Return a .blend with a mesh of one face."""
    turns = np.linspace(0.0, 2.0 * math.pi, corner_count, endpoint=False)
    data = bpy.data.meshes.new("Disk")
    data.from_pydata(np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1), [], [range(corner_count)])
    scene.collection.objects.link(bpy.data.objects.new("Disk", data))
    path = folder / "disk.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_a_face_that_would_take_minutes_is_refused(scene, tmp_path):
    words = ("groom", disk_file(scene, tmp_path, 100_001), *SMALL, "--out", tmp_path / "out.npz")
    reported = '"Disk" has a face with more than 100000 corners: split it into smaller faces.'
    assert sentence(*words) == f"vellus: {reported}\n"
    assert [each.name for each in tmp_path.iterdir()] == ["disk.blend"]
    bpy.context.view_layer.objects.active = bpy.data.objects["Disk"]
    with pytest.raises(RuntimeError, match="face with more than 100000 corners"):
        bpy.ops.vellus.add_hair(guide_count=5, strand_count=20)
    assert not bpy.data.hair_curves


def test_a_face_of_as_many_corners_as_may_be_is_groomed(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(scene_data, "_MOST_CORNERS", 1000)  # of the real number it takes eleven seconds
    assert run_here("groom", disk_file(scene, tmp_path, 1000), *SMALL, "--out", tmp_path / "out.npz").status == 0


# Names.


@pytest.mark.parametrize("option", ["surface", "density-group", "density-image", "region-attribute", "part-lines"])
def test_a_long_name_that_is_not_there(mesh, option):  # noqa: F811
    path = mesh("mesh.blend")
    assert LONG in sentence("groom", path, *SMALL, "--out", path.with_name("out.npz"), f"--{option}", LONG)


@pytest.mark.parametrize("ending", ["blend", "obj", "json", "npz"])
def test_a_long_path_that_cannot_be(tmp_path, ending):
    assert "File name too long" in sentence("info", tmp_path / f"{LONG}.{ending}")


@pytest.mark.parametrize("ending", ["blend", "npz", "usdc"])
def test_a_long_path_to_write_that_cannot_be(mesh, ending):  # noqa: F811
    path = mesh("mesh.obj")
    assert "File name too long" in sentence("groom", path, *SMALL, "--out", path.with_name(f"{LONG}.{ending}"))


def test_a_long_path_of_a_picture_that_cannot_be(lit, tmp_path):
    with pytest.raises(HairError, match="File name too long"):
        api.render(tmp_path / f"{LONG}.png", width=16, height=16)


@pytest.mark.parametrize("value", ["\\ud800", "a\\u0000b"], ids=["surrogate", "null"])
def test_an_invalid_name_in_a_file_is_refused(mesh, value):  # noqa: F811
    path = mesh("mesh.obj")
    settings = path.with_name("groom.json")
    content = settings_file.text_of(settings_file.to_object(api.GroomSettings()))
    settings.write_text(content.replace('"density_group": ""', f'"density_group": "{value}"', 1))
    for words in (
        ("groom", path, *SMALL, "--out", path.with_name("out.npz"), "--settings", settings),
        ("info", settings),
        ("settings", "--settings", settings, "--out", path.with_name("other.json")),
    ):
        assert "has a character that is not allowed" in sentence(*words)
    assert sorted(each.name for each in path.parent.iterdir()) == ["groom.json", "mesh.mtl", "mesh.obj"]


@pytest.mark.parametrize(
    "words",
    [
        ("info", b"\xff.blend"),
        ("settings", "--out", b"\xff.json"),
        ("groom", "a.obj", "--out", "a.npz", "--density-group", b"\xff"),
    ],
)
def test_arguments_that_are_not_utf8_are_refused(capfd, words):
    assert run_here(*map(os.fsdecode, words)).status == 2
    assert "is not valid UTF-8" in capfd.readouterr().err


# Odd places.


@pytest.mark.parametrize("folder", ["a b", "毛 ä", "a#b", "50 %", "{blend_name}", "{", "a}}b{{c"])
def test_frames_go_where_they_are_asked_for(lit, tmp_path, folder):
    """Frames go to the requested path, also if it has words in braces, which Blender takes for variables."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    out = tmp_path / folder / "f{frame}_#.png"
    ended = run_here("render", tmp_path / "shot.blend", "--frames", 1, "--width", 16, "--samples", 1, "--out", out)
    assert ended.status == 0, ended.errors
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["shot.blend", folder])
    assert sorted(path.name for path in (tmp_path / folder).iterdir()) == [".f{frame}_#.png.json", "f{frame}_1.png"]


def test_a_backslash_in_a_folder_name_is_refused(lit, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert "backslash" in sentence("render", tmp_path / "shot.blend", "--out", tmp_path / "a\\b" / "f_#.png")
    assert [each.name for each in tmp_path.iterdir()] == ["shot.blend"]


@pytest.mark.parametrize("ending", ["blend", "obj", "json", "npz", "exr"])
def test_a_pipe_is_not_accepted_as_a_file(tmp_path, ending):
    """A pipe is not accepted as an input file, as reading it would never end."""
    os.mkfifo(tmp_path / f"pipe.{ending}")
    sentence("info", tmp_path / f"pipe.{ending}")


@pytest.mark.parametrize(
    "words",
    [
        ("settings", "--out", "pipe.json"),
        ("groom", "mesh.obj", *SMALL, "--out", "pipe.npz"),
        ("render", "shot.blend", "--frames", 1, "--width", 16, "--out", "pipe.png"),
    ],
    ids=lambda words: words[0],
)
def test_a_pipe_or_device_keeps_its_place(lit, tmp_path, monkeypatch, words):
    """A pipe or a device as output is refused and not replaced, as replacing /dev/null would damage the system."""
    monkeypatch.chdir(tmp_path)
    write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    os.mkfifo(words[-1])
    assert "device" in sentence(*words)
    assert (tmp_path / words[-1]).is_fifo() and len(list(tmp_path.iterdir())) == 3


def test_settings_need_a_name():
    sentence("settings", "--out", "")


# Frames.


def test_the_frames_are_those_of_blender():
    frame = bpy.types.Scene.bl_rna.properties["frame_current"]
    assert (frame.hard_min, frame.hard_max) == (FIRST_FRAME, LAST_FRAME)


@pytest.mark.parametrize("frames", ["1048575", "1-1048575", "-1048575", "9999999"])
def test_a_frame_outside_blenders_range_is_refused(capfd, frames):
    assert run_here("render", "a.blend", "--out", "f_#.png", f"--frames={frames}").status == 2
    assert "is outside Blender's frame range" in capfd.readouterr().err


@pytest.mark.parametrize("frame", [FIRST_FRAME - 1, LAST_FRAME + 1])
def test_a_script_s_frame_outside_blenders_range_is_refused(lit, tmp_path, frame):
    with pytest.raises(HairError, match="There is no frame"):
        api.render(tmp_path / "f_#.png", frame=frame, width=16, height=16)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("engine", ["vellus", "cycles"])
def test_a_scene_without_a_view_layer_is_not_rendered(lit, tmp_path, engine):
    """A scene without a view layer is refused, as rendering it would end Blender."""
    for layer in bpy.context.scene.view_layers:
        layer.use = False
    with pytest.raises(HairError, match="No view layer"):
        api.render(tmp_path / "f.png", engine=engine, width=16, height=16)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "off.blend"))
    for name in ("f.png", "f_#.png"):
        words = ("render", tmp_path / "off.blend", "--frames", 1, "--engine", engine, "--out", tmp_path / name)
        assert "No view layer" in sentence(*words)
    assert [each.name for each in tmp_path.iterdir()] == ["off.blend"]


# Standard output.


@pytest.mark.farm
@pytest.mark.parametrize(
    ("words", "redirected"),
    [
        (("settings",), "> /dev/full"),
        (("settings",), ">&-"),
        (("settings",), "| true"),
        (("info", "mesh.obj"), "> /dev/full"),  # Blender is there
    ],
)
def test_lost_output_is_a_failure(tmp_path, words, redirected):
    write_obj(tmp_path / "mesh.obj", *TETRAHEDRON)
    line = " ".join([*command(*words), redirected])
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {line}"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": PYTHONPATH},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr and len(done.stderr.splitlines()) <= 1
    if "true" not in redirected:
        assert done.stderr.startswith("vellus: Results were lost: standard output cannot be written")
