# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that begin with // are relative to the .blend, on the command line and in scripts."""

import shutil
from pathlib import Path

import bpy
import pytest

from hair_addon import api
from hair_addon.core.errors import HairError
from hair_addon.core.imaging import picture_checks
from tests.blender.io.test_sequence import turning  # noqa: F401 (a fixture)
from tests.support.commands import HEAD, run_here

FOLDER = "vellus_beside"  # must not appear at the root of the disk


@pytest.fixture
def shot(turning, tmp_path):  # noqa: F811
    """Return a .blend with hair in a folder of its own."""
    yield Path(shutil.copy(turning, tmp_path / "shot.blend"))
    assert not Path("/", FOLDER).exists()


def test_frames_are_written_beside_the_blend(shot):
    ended = run_here(
        "render", shot, "--frames", "2-3", "--out", f"//{FOLDER}/f_####.exr", "--width", 16, "--samples", 1
    )
    assert ended.status == 0, ended.errors
    there = sorted((shot.parent / FOLDER).glob("*.exr"))
    assert [path.name for path in there] == ["f_0002.exr", "f_0003.exr"]
    assert all(map(picture_checks.is_whole, there))


def test_several_processes_write_there_too(shot, monkeypatch):
    """Several processes write to a path relative to the .blend, as their commands have the whole path and all
    options.
    """
    from hair_addon.command_line import helpers, parser

    reported = []
    monkeypatch.setattr(helpers, "run", lambda commands, *_: reported.extend(commands) or [])
    words = ["render", shot, "--frames=-5--2", "--out", f"//{FOLDER}/f_#.exr", "--width", 16, "--jobs", 2, "--passes"]
    assert "Frame -5 was not rendered" in run_here(*words).errors  # as nobody has
    given = parser("vellus").parse_args(reported[0][reported[0].index("render") :])
    assert Path(given.out) == shot.parent / FOLDER / "f_#.exr" and Path(given.input) == shot
    assert (given.frames, given.width, given.passes) == (range(-5, -1), 16, True)


def test_settings_and_grooms_are_beside_the_blend(shot):
    api.save_settings(shot.parent / "groom.json", api.GroomSettings(api.GuideSettings(guide_count=7)))
    words = ["groom", shot, "--surface", "Sphere", "--strands", 20, "--settings", "//groom.json"]
    ended = run_here(*words, "--out", f"//{FOLDER}/../{FOLDER}/hair.npz")
    assert ended.status == 0 and ended.out.startswith("7 guides"), ended.errors
    assert (shot.parent / FOLDER / "hair.npz").is_file()


@pytest.mark.parametrize(
    "words",
    [
        ("render", "//shot.blend", "--out", "f_#.png"),
        ("info", "//groom.json"),
        ("export", "//shot.blend", "--out", "hair.abc"),
        ("groom", HEAD, "--out", f"//{FOLDER}/hair.npz"),
        ("groom", HEAD, "--settings", f"//{FOLDER}/a.json", "--out", "hair.npz"),
        ("bake-tables", "--out", f"//{FOLDER}"),
        ("bake-tables", "--settings", f"//{FOLDER}/a.json", "--out", "tables"),
        ("settings", "--out", f"//{FOLDER}/a.json"),
        ("settings", "--settings", f"//{FOLDER}/a.json"),
    ],
)
def test_without_a_blend_one_sentence(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = run_here(*words)
    assert ended.status == 1 and "begins with //" in ended.errors and len(ended.errors.splitlines()) == 1
    assert not list(tmp_path.iterdir()) and not Path("/", FOLDER).exists()


def test_scripts_name_paths_beside_the_blend(shot):
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    made = api.render(f"//{FOLDER}/f_##.png", frame=2, width=16, height=16, sample_count=1)
    assert made == shot.parent / FOLDER / "f_02.png" and picture_checks.is_whole(made)
    settings = api.GroomSettings(api.GuideSettings(guide_count=7))
    api.save_settings(f"//{FOLDER}/a.json", settings)
    assert (shot.parent / FOLDER / "a.json").is_file() and api.load_settings(f"//{FOLDER}/a.json") == settings
    tables = api.bake_tables(f"//{FOLDER}/tables", size=16)
    assert {path.parent for path in tables} == {shot.parent / FOLDER / "tables"}


@pytest.mark.parametrize(
    "call",
    [
        lambda path: api.render(path + ".png"),
        lambda path: api.save_settings(path, api.GroomSettings()),
        api.load_settings,
        lambda path: api.bake_tables(path, size=16),
    ],
)
def test_scripts_without_a_blend_get_one_sentence(lit, call):
    assert not bpy.data.filepath
    with pytest.raises(HairError, match="save the file first"):
        call(f"//{FOLDER}/a")
    assert not Path("/", FOLDER).exists()
