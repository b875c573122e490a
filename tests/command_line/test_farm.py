# SPDX-License-Identifier: GPL-3.0-or-later
"""The job type for Flamenco: its tasks, and that their commands make the frames."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.blender.io.test_sequence import turning  # noqa: F401 (a fixture)
from tests.support.commands import ROOT, run_here

SCRIPT = ROOT / "docs" / "farm" / "vellus-render.js"
MANAGER = Path(__file__).with_name("flamenco.js")

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="needs node, which runs the job type")


def compiled(**settings):
    """{type, tasks} that the job type makes of settings."""
    words = ["node", str(MANAGER), str(SCRIPT), json.dumps(settings)]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True, timeout=60).stdout)


def test_frames_are_shared_out_in_tasks_and_checked_in_the_end():
    job = compiled(frames="1-5, 9", chunk_size=2, pattern="/f_#.exr", blendfile="/a.blend")
    names = [task["name"] for task in job["tasks"]]
    assert names == ["render-1-2", "render-3-4", "render-5,9", "check"]
    assert all(task["type"] == "blender" for task in job["tasks"])
    assert [task["waits"] for task in job["tasks"]] == [[], [], [], names[:3]]
    assert [len(task["commands"]) for task in job["tasks"]] == [1, 1, 2, 2]


def test_every_setting_has_what_flamenco_asks_for():
    for setting in compiled(frames="1", pattern="/f_#.exr", blendfile="/a.blend")["type"]["settings"]:
        assert setting["type"] in {"string", "int32", "bool"} and setting["description"]


def test_its_commands_make_the_frames(turning, tmp_path):  # noqa: F811
    settings = {"frames": "1-3, 6", "chunk_size": 2, "pattern": str(tmp_path / "f_#.exr"), "blendfile": str(turning)}
    made = []
    for task in compiled(**settings, samples=1)["tasks"]:
        for command in task["commands"]:
            assert (command["name"], command["parameters"]["exe"]) == ("exec", "{blender}")
            words = command["parameters"]["args"]
            assert words[:2] == ["--command", "vellus"]
            ended = run_here(*words[2:], "--json")
            assert ended.status == 0, ended.errors
            made.append([result["frame"] for result in ended.results])
    assert made == [[1, 2], [3], [6], [], []]
    assert sorted(path.name for path in tmp_path.glob("*.exr")) == [f"f_{number}.exr" for number in (1, 2, 3, 6)]
