# SPDX-License-Identifier: GPL-3.0-or-later
"""`simulate` bakes frames that can be resumed and rendered; errors are one message."""

import itertools
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import broken_guides, frame_folders, guide_baking
from hair_addon.blender.host import memory
from hair_addon.blender.live import simulated_hair
from hair_addon.blender.render.viewport import viewport
from hair_addon.core import dynamics
from hair_addon.core.errors import HairError
from tests.support.commands import ROOT, command, run_here
from tests.support.dynamics.swung import simulate, swing
from tests.support.reading import evaluated_points, read_picture


def guides_of():
    return bpy.data.hair_curves["Guides"]


@pytest.fixture
def shot(lit, tmp_path):
    """Return a .blend with hair on a swinging sphere, whose guides simulate."""
    swing(bpy.data.objects["Sphere"])
    simulate(bpy.data.objects["Guides"], "//frames")
    bpy.context.scene.frame_end = 6
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.farm
def test_frames_are_baked_and_rendered(shot, tmp_path):
    first = run_here("simulate", shot, "--json", "--last-frame", "3")
    assert [line["frame"] for line in first.results] == [2, 3, 4]  # one more for motion blur
    assert [line["frame"] for line in run_here("simulate", shot, "--json").results] == [5, 6, 7]
    size = ("--width", "64", "--height", "64", "--samples", "4")
    run_here("render", shot, "--out", tmp_path / "f_##.png", "--frames", "1-4", *size)
    pictures = [read_picture(tmp_path / f"f_{frame:02}.png") for frame in (1, 4)]
    assert not np.array_equal(*pictures)


@pytest.mark.long
def test_halves_of_a_shot_that_two_processes_render_are_those_of_one(shot, tmp_path):
    run_here("simulate", shot)
    size = ("--width", "48", "--height", "32", "--samples", "1")
    # All in processes of their own: shadow maps of tests are coarse.
    parts = {"one_#.exr": ["1-6"], "two_#.exr": ["1-3", "4-6"]}
    words = [("render", shot, "--out", tmp_path / out, "--frames", part, *size) for out in parts for part in parts[out]]
    processes = [subprocess.Popen(command(*of_one), cwd=ROOT) for of_one in words]
    assert [process.wait(300) for process in processes] == [0, 0, 0]
    pictures = [[read_picture(tmp_path / f"{name}_{frame}.exr") for frame in range(1, 7)] for name in ("one", "two")]
    assert np.array_equal(*pictures)
    assert not np.array_equal(pictures[0][2], pictures[0][3])


@pytest.mark.long
def test_one_of_two_processes_that_bake_at_once_is_refused(shot, tmp_path):
    both = [subprocess.Popen(command("simulate", shot), cwd=ROOT, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    reported = [process.communicate(timeout=1200)[1] for process in both]
    statuses = sorted(process.returncode for process in both)
    assert statuses in ([0, 0], [0, 1])  # the second may have come when the first was done
    assert statuses == [0, 0] or any("is being baked by another process" in text for text in reported)
    frames = [*(tmp_path / "frames").rglob("+*.npz")]
    assert len(frames) == 7 and run_here("simulate", shot, "--json").results == []


def test_frames_are_given_as_for_render(shot):
    def simulated(*words):
        return [line["frame"] for line in run_here("simulate", shot, "--json", *words).results]

    assert simulated("--frames", "3-4") == [2, 3, 4, 5]  # what is before them too, and one more for motion blur
    assert simulated("--frames", "5") == [6]
    assert simulated("--frames", "all") == [7]
    assert run_here("simulate", shot, "--frames", "1-2", "--last-frame", "2").status == 2
    refused = run_here("simulate", shot, "--deliver", shot.with_name("delivered.blend"), "--frames", "1-4")
    assert refused.status == 1 and "leave out --frames" in refused.errors


def test_the_time_of_all_guides_is_reported(shot, monkeypatch):
    """The reported time counts reading, simulation and half of each frame change, by a clock of one second per
    reading.
    """
    other = bpy.data.objects["Guides"].copy()
    other.data = other.data.copy()
    bpy.context.scene.collection.objects.link(other)
    other.data.vellus.cache_identity = ""
    bpy.ops.wm.save_mainfile()
    looks = itertools.count()
    monkeypatch.setattr(guide_baking, "_now", lambda: float(next(looks)))
    lines = run_here("simulate", shot, "--frames", "1-2", "--json").results
    assert len({line["guides"] for line in lines}) == 2
    assert [(line["frame"], line["seconds"]) for line in lines] == [(2, 2.5), (2, 2.5), (3, 2.5), (3, 2.5)]


def test_guides_that_break_are_reported_in_the_terminal_and_the_panel(shot, monkeypatch):
    counts = {3: 2, 5: 7}

    def broken(_simulation):
        return np.arange(counts.get(bpy.context.scene.frame_current, 0))

    monkeypatch.setattr(dynamics.simulation.Simulation, "broken", property(broken))
    reported = 'of 60 guides of "Guides" broke in frame {} and were reset: increase Substeps.'
    first = run_here("simulate", shot, "--frames", "1-3", "--json")
    assert first.errors == f"vellus: warning: 2 {reported.format(3)}\n"
    assert [line["broken"] for line in first.results] == [0, 2, 0]
    counts.pop(3)
    # Baking goes on, and another session opens the file.
    ended = run_here("simulate", shot)
    assert (ended.status, ended.errors) == (0, f"vellus: warning: 7 {reported.format(5)}\n")
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    bpy.context.scene.frame_set(2)
    (note,) = simulated_hair.notes_of(bpy.data.hair_curves["Guides"])
    assert str(note) == f"7 {reported.format(5)}"
    counts.clear()
    assert run_here("simulate", shot, "--overwrite").errors == ""
    assert broken_guides.baked(bpy.data.hair_curves["Guides"]) == broken_guides.NONE


def test_frames_that_are_not_baked_are_not_rendered(shot, tmp_path):
    refused = run_here("render", shot, "--out", tmp_path / "f_##.png", "--frames", "1-3")
    assert refused.status == 1
    assert "Frame 2 of the guides" in refused.errors and "not baked" in refused.errors
    assert not list(tmp_path.glob("*.png"))


def test_a_frame_that_cannot_be_read_is_refused_as_a_missing_one(shot, tmp_path):
    """An unreadable frame is refused like a missing one by renders, exports and pictures, and only baking repairs
    it.
    """
    run_here("simulate", shot)
    whole = {path.name: path.read_bytes() for path in frame_folders.folder_of(guides_of()).glob("*.npz")}
    damaged = frame_folders.folder_of(guides_of()) / "+00000005.npz"
    turned = bytearray(whole[damaged.name])
    turned[-400] ^= 1  # a bit of its points
    size = ("--width", "16", "--height", "16", "--samples", "1", "--engine", "cycles")
    out = tmp_path / "f_##.png"
    sentence = 'Frame 5 of the guides "Guides" cannot be read: bake it again.'
    for content in (turned, whole[damaged.name][:-1], b""):
        damaged.write_bytes(content)
        for words in (("--frames", "4-6"), ("--frames", "4-6", "--jobs", "2"), ("--frames", "5")):
            refused = run_here("render", shot, "--out", out, *words, *size)
            assert refused.status == 1 and sentence in refused.errors
    assert not list(tmp_path.glob("*.png"))
    assert run_here("info", shot, "--json").results[0]["guides"][0]["baked"]["missing"] == [5]
    for refused in (lambda: api.render(out, frame=5, width=16, height=16), lambda: api.draw(width=16, height=16)):
        bpy.context.scene.frame_set(5)
        with pytest.raises(HairError, match="Frame 5 of the guides"):
            refused()
    with pytest.raises(HairError, match="Frame 5 of the guides"):
        api.export_groom(tmp_path / "groom.usdc", animation="ALL")
    bpy.context.scene.frame_set(5)
    with pytest.raises(HairError, match="Frame 5 of the guides"):
        api.export_groom(tmp_path / "groom.usdc")
    with pytest.raises(RuntimeError, match="Frame 5 of the guides"):  # as Blender's own menu renders
        bpy.context.scene.render.engine = viewport.ENGINE
        bpy.ops.render.render()
    assert bpy.data.hair_curves["Guides"].vellus.dynamics_status == sentence
    bpy.context.scene.frame_set(4)
    assert bpy.data.hair_curves["Guides"].vellus.dynamics_status == ""
    done = run_here("simulate", shot, "--json")
    assert done.status == 0 and [line["frame"] for line in done.results] == [*range(2, 8)]
    assert {path.name: path.read_bytes() for path in damaged.parent.glob("*.npz")} == whole
    assert run_here("render", shot, "--out", out, "--frames", "4-6", *size).status == 0
    bpy.context.scene.frame_set(5)
    assert bpy.data.hair_curves["Guides"].vellus.dynamics_status == ""


def test_frames_that_an_exposure_reads_are_whole_too(shot):
    """Frames that motion blur reads beside a picture's frame are checked too."""
    run_here("simulate", shot)
    folder, scene = frame_folders.folder_of(guides_of()), bpy.context.scene
    (folder / "+00000005.npz").write_bytes(b"damaged")
    frame_folders.require_baked([4], scene)
    scene.render.use_motion_blur = True
    frame_folders.require_baked([1, 2], scene)
    with pytest.raises(HairError, match="Frame 5 of the guides"):
        frame_folders.require_baked([4], scene)
    (folder / "+00000006.npz").unlink()
    scene.render.motion_blur_position = "START"
    with pytest.raises(HairError, match="Frame 6 of the guides"):
        frame_folders.require_baked([5], scene)


def test_files_without_simulated_guides_are_refused(shot):
    assert "no guides" in run_here("simulate", shot, "--guides", "Nobody").errors
    bpy.data.objects["Guides"].data.vellus.simulates = False
    bpy.ops.wm.save_mainfile()
    ended = run_here("simulate", shot)
    assert ended.status == 1 and "no guides with Dynamics on" in ended.errors
    needless = run_here("simulate", shot, "--if-needed", "--json")
    assert (needless.status, needless.results) == (0, [])
    delivered = run_here("simulate", shot, "--if-needed", "--deliver", shot.with_name("delivered.blend"))
    assert delivered.status == 1 and "no guides with Dynamics on" in delivered.errors


def test_only_what_is_rendered_is_simulated_if_needed(shot):
    """With --if-needed only rendered guides are simulated: none that start later, and none whose hair is delivered."""
    assert run_here("simulate", shot, "--if-needed", "--last-frame", "1", "--json").results == []
    frame_folders.require_baked([1], bpy.context.scene)
    assert [line["frame"] for line in run_here("simulate", shot, "--if-needed", "--json").results] == [*range(2, 8)]
    out = shot.with_name("delivered.blend")
    assert run_here("simulate", shot, "--deliver", out).status == 0
    assert run_here("simulate", out, "--if-needed", "--overwrite", "--json").results == []


def test_what_is_baked_is_shown(shot):
    def told():
        (guides,) = run_here("info", shot, "--json").results[0]["guides"]
        return guides["baked"]

    assert told() is None
    run_here("simulate", shot, "--last-frame", "4")
    baked = told()
    assert (baked["first"], baked["last"], baked["state"]) == (1, 4, "complete")
    assert baked["missing"] == baked["outdated"] == []
    next(Path(baked["folder"]).glob("+00000003.npz")).unlink()
    state = bpy.data.objects["Guides"].data.vellus
    state.dynamics.damping = 0.1
    bpy.context.scene.render.fps = 30
    bpy.ops.wm.save_mainfile()
    assert (told()["missing"], told()["outdated"]) == ([3], ["frame rate", "settings"])
    assert "outdated: ['frame rate', 'settings']" in run_here("info", shot).out


def test_a_delivered_file_needs_no_cache(shot, tmp_path):
    out = tmp_path / "elsewhere" / "delivered.blend"
    told = run_here("simulate", shot, "--deliver", out, "--json").results[-1]
    assert told["delivered"] == str(out.with_name("delivered_Guides.usdc")) and (told["first"], told["last"]) == (1, 6)
    assert [*sorted(path.name for path in out.parent.iterdir())] == ["delivered.blend", "delivered_Guides.usdc"]
    hair = bpy.data.objects["Hair"]
    bpy.context.scene.frame_set(5)
    live = evaluated_points(hair)
    bpy.ops.wm.open_mainfile(filepath=str(out))
    (cache_file,) = bpy.data.cache_files
    assert cache_file.filepath == "//delivered_Guides.usdc"
    bpy.data.hair_curves["Guides"].vellus.cache_folder = "//nothing"
    bpy.context.scene.frame_set(5)
    np.testing.assert_allclose(evaluated_points(bpy.data.objects["Hair"]), live, atol=1e-6)
    frame_folders.require_baked(range(1, 7), bpy.context.scene)
    for name in (shot, tmp_path / "delivered.usdc"):
        assert run_here("simulate", shot, "--deliver", name).status == 1


def test_a_part_of_a_shot_is_not_delivered_and_not_simulated_for_it(shot, tmp_path):
    refused = run_here("simulate", shot, "--deliver", tmp_path / "delivered.blend", "--last-frame", "4")
    assert refused.status == 1 and "needs all frames of the scene, to 6" in refused.errors
    assert not frame_folders.has_frames(bpy.data.hair_curves["Guides"])


def test_too_little_memory_is_reported(shot, monkeypatch):
    needed = guide_baking.memory_of([bpy.data.hair_curves["Guides"]])
    monkeypatch.setattr(memory, "free_bytes", lambda: needed * 2)
    warned = run_here("simulate", shot, "--last-frame", "1")
    assert warned.status == 0 and "takes 50 % of the free memory" in warned.errors
    monkeypatch.setattr(memory, "free_bytes", lambda: needed * 1.4)
    refused = run_here("simulate", shot, "--overwrite")
    assert refused.status == 1 and "use fewer guides" in refused.errors
    assert memory.share_of_free(needed) > memory.MOST and not guide_baking.is_baking()


def test_free_memory_is_what_the_system_says():
    assert memory.free_bytes() > 50e6


def test_without_the_colliders_that_guides_name_nothing_is_baked(shot, tmp_path):
    """Nothing is baked if a collection of colliders is missing; a renamed collection is followed."""
    guides = bpy.data.objects["Guides"].data
    body = bpy.data.collections.new("Body")
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.3, location=(1.2, 0.0, 0.0))
    body.objects.link(bpy.context.object)
    guides.vellus.dynamics.colliders = "Body"
    bpy.context.view_layer.update()
    body.name = "COL body"
    bpy.ops.wm.save_mainfile()
    assert run_here("simulate", shot, "--last-frame", "2").status == 0
    bpy.data.collections.remove(bpy.data.collections["COL body"])
    bpy.ops.wm.save_mainfile()
    refused = run_here("simulate", shot, "--last-frame", "4")
    assert refused.status == 1
    assert (
        'There is no collection "COL body" of colliders: pick another collection, or clear the field.' in refused.errors
    )
    assert not list((tmp_path / "frames").rglob("+00000004.npz"))
