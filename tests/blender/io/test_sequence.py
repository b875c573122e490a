# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences of frames may be stopped, resumed and shared by processes: no frame is rendered twice or damaged."""

import contextlib
import errno
import itertools
import json
import os
import shutil
import signal
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon.blender.io.pictures import frames, sequence
from hair_addon.command_line import render
from hair_addon.core.errors import HairError
from hair_addon.core.files import file_lock
from hair_addon.core.files.atomic_file import atomic_file, partial_of
from hair_addon.core.files.file_lock import claim, claim_of
from tests.support.commands import PYTHONPATH, ROOT, command, largest_file, run_here
from tests.support.scenes import shrink_shadows

COUNT = 5

HOLD = """
import sys, time
from pathlib import Path
from hair_addon.core.files.file_lock import claim, claim_of
with claim(sys.argv[1]):
    print(flush=True)
    while not Path(sys.argv[3]).exists():
        time.sleep(0.01)
    Path(sys.argv[2]).touch()
"""
ENVIRONMENT = os.environ | {"PYTHONPATH": PYTHONPATH}


@pytest.fixture(scope="module", autouse=True)
def shadows_of_child_processes():
    """Use shadow maps as small as in the processes that this file starts, because pictures must be equal."""
    with pytest.MonkeyPatch.context() as patch:
        shrink_shadows(patch)
        yield


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """Return a .blend of a ball with hair that turns before a camera."""
    path = tmp_path_factory.mktemp("turning") / "ball.blend"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1)
    ball = bpy.context.object
    for frame, angle in ((1, 0.0), (COUNT, 2.0)):
        ball.rotation_euler.z = angle
        ball.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.vellus.add_hair(guide_count=30, strand_count=200, length=0.08, gravity=1.0, radius=0.002)
    bpy.ops.object.light_add(type="SUN")
    bpy.ops.object.camera_add(location=(0.0, -0.6, 0.0), rotation=(np.pi / 2.0, 0.0, 0.0))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.frame_end, scene.render.resolution_x, scene.render.resolution_y = COUNT, 64, 48
    scene.vellus.sample_count, scene.vellus.multiple_scattering = 4, "DUAL"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def words(turning, folder, *more, ending="png"):
    return ("render", turning, "--frames", f"1-{COUNT}", "--out", folder / f"f_###.{ending}", "--json", *more)


def start(turning, folder):
    """Start the command in a separate process whose standard output can be read."""
    line = list(map(str, command(*words(turning, folder))))
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(line, text=True, env=ENVIRONMENT, cwd=ROOT, **pipes)


def pixels(path):
    """Return (N,) float32 values of a picture."""
    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values


def frame_numbers(ended):
    return [result["frame"] for result in ended.results]


def pictures(folder):
    return sorted(path.name for path in folder.glob("*.png"))


def hidden(folder):
    return sorted(path.name for path in folder.glob(".*"))


ALL = [f"f_{number:03}.png" for number in range(1, COUNT + 1)]


@pytest.fixture(scope="module")
def whole(turning, tmp_path_factory):
    """Return the folder of the reference: the sequence rendered by this process in one run."""
    folder = tmp_path_factory.mktemp("whole")
    ended = run_here(*words(turning, folder))
    assert ended.status == 0, ended.errors
    assert frame_numbers(ended) == list(range(1, COUNT + 1))
    assert pictures(folder) == ALL
    return folder


def test_hair_turns_with_its_surface(whole):
    made = [pixels(whole / name) for name in ALL]
    assert all(np.abs(one - other).max() > 0.05 for one, other in itertools.combinations(made, 2))


def test_a_frame_does_not_depend_on_those_before(turning, whole, tmp_path):
    ended = run_here("render", turning, "--frames", "4-4", "--out", tmp_path / "f_###.png", "--json")
    assert frame_numbers(ended) == [4]
    np.testing.assert_array_equal(pixels(tmp_path / ALL[3]), pixels(whole / ALL[3]))


@pytest.mark.farm
@pytest.mark.parametrize("asked", [signal.SIGKILL, signal.SIGINT], ids=["killed", "Ctrl-C"])
def test_the_same_command_goes_on(turning, whole, tmp_path, asked):
    """A stopped command continues when it is started again. The test claims the last frame until the command stops, so
    that it cannot end earlier.
    """
    with claim(tmp_path / ALL[-1]), start(turning, tmp_path) as process:
        lines = [process.stdout.readline() for _ in range(2)]
        process.send_signal(asked)
        printed, errors = process.communicate(timeout=600)
    told = [json.loads(line) for line in [*lines, *printed.splitlines()]]
    first = [values["frame"] for values in told]
    there = {name: (tmp_path / name).stat().st_mtime_ns for name in pictures(tmp_path)}
    assert 2 <= len(there) < COUNT
    if asked == signal.SIGINT:
        assert (process.returncode, errors) == (130, "vellus: stopped: unfinished results were not written.\n")
        assert sorted(values["out"] for values in told) == [str(tmp_path / name) for name in there]
    ended = run_here(*words(turning, tmp_path))
    assert ended.status == 0, ended.errors
    assert set(frame_numbers(ended)).isdisjoint(first)
    assert pictures(tmp_path) == ALL
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in there} == there
    assert hidden(tmp_path) == [".f_###.png.json"]
    for name in ALL:
        np.testing.assert_array_equal(pixels(tmp_path / name), pixels(whole / name))
    assert frame_numbers(run_here(*words(turning, tmp_path))) == []


@pytest.mark.farm
def test_another_machine_goes_on(turning, whole, tmp_path):
    """Another machine continues a sequence under other paths of the file and of the frames, as only their contents
    count.
    """
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    shutil.copy(turning, here / "ball.blend")
    assert run_here("render", here / "ball.blend", "--frames", "1-3", "--out", here / "f_###.png").status == 0
    here.rename(there)
    ended = run_here(*words(there / "ball.blend", there))
    assert frame_numbers(ended) == [4, 5]
    for name in ALL:
        np.testing.assert_array_equal(pixels(there / name), pixels(whole / name))


@pytest.mark.farm
def test_processes_share_the_frames(turning, whole, tmp_path, monkeypatch):
    """Workers of one command share the frames, also with another command that runs at the same time."""
    others, sentence_of = [], render._sentence

    def told(values):
        if not others:
            others.append(None)
            others[0] = run_here(*words(turning, tmp_path))
        return sentence_of(values)

    monkeypatch.setattr(render, "_sentence", told)
    monkeypatch.setenv("PYTHONPATH", PYTHONPATH)
    ended = run_here(*words(turning, tmp_path, "--jobs", 2))
    assert (ended.status, others[0].status) == (0, 0), ended.errors + others[0].errors
    assert sorted(frame_numbers(ended) + frame_numbers(others[0])) == list(range(1, COUNT + 1))
    for name in ALL:
        np.testing.assert_array_equal(pixels(tmp_path / name), pixels(whole / name))
    assert hidden(tmp_path) == [".f_###.png.json"]


def test_frames_of_another_sequence_are_kept(turning, tmp_path):
    with contextlib.chdir(tmp_path):
        assert run_here(*words(turning, tmp_path)).status == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    ended = run_here(*words(turning, tmp_path, "--width", 32))
    assert ended.status == 1 and ".f_###.png.json belongs to another sequence (settings)" in ended.errors
    (tmp_path / ".f_###.png.json").unlink()
    ended = run_here(*words(turning, tmp_path))
    assert ended.status == 1 and "f_001.png belongs to no known sequence" in ended.errors
    (tmp_path / ".f_###.png.json").write_text("half of")
    ended = run_here(*words(turning, tmp_path))
    assert ended.status == 1 and "cannot be read" in ended.errors
    assert all(path.read_bytes() == held for path, held in before.items() if path.suffix == ".png")
    ended = run_here(*words(turning, tmp_path, "--width", 32, "--overwrite"))
    assert ended.status == 0 and frame_numbers(ended) == list(range(1, COUNT + 1))
    assert frame_numbers(run_here(*words(turning, tmp_path, "--width", 32))) == []


def test_a_full_disk_keeps_complete_frames(turning, tmp_path):
    """A disk that becomes full keeps complete frames; a limit on the size of files stands in for it."""
    with largest_file(4096):
        ended = run_here(*words(turning, tmp_path, ending="exr"))
    assert ended.status == 1 and len(ended.errors.splitlines()) == 1
    assert not [path for path in tmp_path.iterdir() if path.suffix == ".exr"]
    assert run_here(*words(turning, tmp_path, ending="exr")).status == 0
    assert len(list(tmp_path.glob("f_*.exr"))) == COUNT


def test_a_folder_without_space_is_reported(turning, tmp_path, monkeypatch):
    """A folder in which no file can be created is reported."""

    def refuse(_path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(file_lock, "_locked", refuse)
    ended = run_here(*words(turning, tmp_path))
    assert ended.status == 1 and "No space left on device" in ended.errors and len(ended.errors.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.farm
def test_a_failing_worker_reports_its_error_once(turning, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", PYTHONPATH)
    bpy.ops.wm.open_mainfile(filepath=str(turning))
    bpy.data.objects.remove(bpy.context.scene.camera)
    blind = tmp_path / "blind.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blind))
    ended = run_here("render", blind, "--frames", "1-4", "--out", tmp_path / "f_##.png", "--jobs", 2)
    assert ended.status == 1 and len(ended.errors.splitlines()) == 1
    assert ended.errors == "vellus: The scene has no camera: add one.\n"
    assert not list(tmp_path.glob("f_*.png")) and hidden(tmp_path) == [".f_##.png.json"]


@pytest.mark.farm
def test_it_waits_for_frames_of_other_processes(tmp_path):
    """A frame that another process has claimed is rendered here if that process ends without it."""
    pattern = tmp_path / "f_#.png"
    left = tmp_path / "left"
    line = [*command()[:1], "-c", HOLD, str(frames.path_of(pattern, 1)), left, str(frames.path_of(pattern, 2))]
    is_left = {}

    def make(path, number):
        is_left[number] = left.exists()
        path.write_text(str(number))

    with subprocess.Popen(line, stdout=subprocess.PIPE, env=ENVIRONMENT) as holder:
        holder.stdout.readline()
        assert [number for number, _ in sequence.make(pattern, [1, 2], make)] == [2, 1]
    assert is_left[1]


def test_sequences_are_started_by_one_process_at_a_time(tmp_path):
    pattern = tmp_path / "f_#.png"
    sequence.begin(pattern, [1], {"of": "this"})
    sequence.begin(pattern, [1], {"of": "this"})
    with pytest.raises(HairError, match="another sequence"):
        sequence.begin(pattern, [1], {"of": "that"})
    with claim(sequence.record_of(pattern)) as is_ours:
        assert is_ours


def spoil(folder, ending):
    """Leave frame 1 empty and frame 2 truncated, as another program or a lost network drive does."""
    (folder / f"f_001.{ending}").write_bytes(b"")
    cut = folder / f"f_002.{ending}"
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])


@pytest.mark.farm
@pytest.mark.parametrize("more", [("--out", "f_###.png"), ("--out", "f_###.exr", "--passes")])
def test_unreadable_pictures_are_rendered_again(turning, tmp_path, monkeypatch, more):
    monkeypatch.chdir(tmp_path)
    line = ("render", turning, "--frames", "1-3", "--width", 32, "--samples", 1, "--json", *more)
    assert frame_numbers(run_here(*line)) == [1, 2, 3]
    ending = more[1][-3:]
    made = {path.name: pixels(path) for path in tmp_path.glob(f"*.{ending}")}
    spoil(tmp_path, ending)
    assert frame_numbers(run_here(*line)) == [1, 2]
    spoil(tmp_path, ending)
    (tmp_path / f".f_###.{ending}.json").unlink()  # as if another program had left them
    (tmp_path / f"f_003.{ending}").unlink()
    assert frame_numbers(run_here(*line)) == [1, 2, 3]
    for name, held in made.items():
        np.testing.assert_array_equal(pixels(tmp_path / name), held)


def test_pictures_of_other_origin_are_kept(turning, tmp_path):
    (tmp_path / "f_002.png").write_text("A text of somebody's.")
    ended = run_here(*words(turning, tmp_path))
    assert ended.status == 1 and "f_002.png belongs to no known sequence" in ended.errors
    (tmp_path / "f_002.png").unlink()
    (tmp_path / "f_002.png").mkdir()
    for more in ((), ("--overwrite",)):
        ended = run_here(*words(turning, tmp_path, *more))
        assert (
            ended.status == 1
            and ended.errors == f"vellus: {tmp_path}/f_002.png is a folder: move it, or choose another file name.\n"
        )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["f_002.png"]


def test_an_unwritten_file_does_not_replace_another(tmp_path):
    (tmp_path / "f.exr").write_text("before")
    for write in (lambda _path: None, Path.touch):
        with pytest.raises(HairError, match="was not written"), atomic_file(tmp_path / "f.exr") as partial:
            write(partial)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("f.exr", "before")]


def test_frames_are_not_written_through_links_that_others_have_prepared(tmp_path):
    """Frames are not written through links: names of unfinished files cannot be guessed, and a claim that is a link
    is refused.
    """
    victim, pattern = tmp_path / "victim", tmp_path / "shots" / "f_#.png"
    victim.write_text("mine")
    pattern.parent.mkdir()
    for name in (".vellus_f_1.png", ".vellus_f_2.png", "f_2.png"):
        os.symlink(victim, pattern.with_name(name))

    def write(path, number):
        with atomic_file(path, partial_of(path)) as partial:
            partial.write_text(f"frame {number}")

    assert [number for number, _path in sequence.make(pattern, [1, 2], write)] == [1, 2]
    assert victim.read_text() == "mine" and pattern.with_name("f_2.png").read_text() == "frame 2"
    left = partial_of(pattern.with_name("f_1.png"))
    os.symlink(victim, left)
    assert sequence.missing_frames(pattern, [1]) == [1]  # no picture
    assert not left.is_symlink() and victim.read_text() == "mine"
    os.symlink(tmp_path / "made", claim_of(pattern.with_name("f_3.png")))
    with pytest.raises(HairError, match="cannot be written"):
        list(sequence.make(pattern, [3], write))
    assert not (tmp_path / "made").exists()


def test_two_writers_of_a_frame_write_to_different_files(tmp_path):
    assert partial_of(tmp_path / "f.png") != partial_of(tmp_path / "f.png")
