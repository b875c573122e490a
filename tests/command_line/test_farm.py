# SPDX-License-Identifier: GPL-3.0-or-later
"""The job type for Flamenco refuses invalid settings, and its tasks have commands that render the right frames."""

import argparse
import shutil

import bpy
import pytest

from hair_addon import command_line
from hair_addon.blender.io.pictures import frames
from hair_addon.command_line import options
from hair_addon.core.errors import HairError
from tests.blender.io.test_sequence import turning  # noqa: F401 (a fixture)
from tests.support.commands import run_here
from tests.support.farms.flamenco import compiled

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="needs node, which runs the job type")

PARSER = command_line.parser("vellus")
SETTINGS = {"frames": "1", "pattern": "/f_#.exr", "blendfile": "/a.blend"}
NUMBERS = ["47", "1-30", "1..6", " 1 - 6 ", "-5", "-10--5", "1.. 3", "007", "1048574", "1048575", "-1048575-1", "5-1"]
NUMBERS += ["1-2-3", "", "1 6", "one", "1-", "1.5", "--5", "1e3", "12345678", "1;2", "0x10"]  # fmt: skip
NAMES = ["f_####.exr", "f_####.png", "f.exr", "f.png", "f_#.EXR", "f_#.jpg", "f_####", ".exr", "f_#.", "a.b/f#.png"]
NAMES += ["f#.exr/", "f#.exr/.", "a#/f.exr", "f\\#.exr", "{a}#.exr"]


def submitted(**settings):
    """Return the job that the manager makes of settings, or its message of refusal."""
    return compiled(SETTINGS | settings)[0]


def sentence_of(job):
    """Return the message that refuses a job, None for an accepted one."""
    return None if job["status"] == 200 else job["message"].rpartition(" at refuse")[0]


def words_of(job):
    """Return {name of a task: the words of each of its commands, after `blender --command vellus`}."""
    tasks = {}
    for task in job["tasks"]:
        assert task["type"] == "blender"
        for command in task["commands"]:
            assert (command["name"], command["parameters"]["exe"]) == ("exec", "{blender}")
            assert command["parameters"]["args"][:2] == ["--command", "vellus"]
            tasks.setdefault(task["name"], []).append(command["parameters"]["args"][2:])
    return tasks


def frames_of(commands):
    """Return the frames that commands render, by the parser of the commands."""
    return [number for words in commands for number in parsed(words).frames]


def parsed(words):
    """Return the options of a command of a task."""
    return PARSER.parse_args(words)


def test_baking_comes_first_and_missing_frames_last():
    job = submitted(frames="1-5, 9", chunk_size=2)
    names = ["simulate", "render-1-2", "render-3-4", "render-5,9", "check"]
    assert [task["name"] for task in job["tasks"]] == names
    assert [task["waits"] for task in job["tasks"]] == [[], *[["simulate"]] * 3, names[1:4]]
    (task,) = submitted(simulate=False, frames="7")["tasks"]
    assert (task["name"], task["waits"]) == ("render-7", [])


def test_each_frame_is_in_one_task_of_bounded_size(rng):
    jobs = []
    for size in rng.integers(1, 9, 30):
        starts, lengths = rng.integers(-30, 30, 4), rng.integers(0, 12, 4)
        text = ", ".join(f"{start}..{start + length}" for start, length in zip(starts, lengths, strict=True))
        jobs.append(SETTINGS | {"frames": text, "chunk_size": int(size)})
    for settings, job in zip(jobs, compiled(*jobs), strict=True):
        wanted = {number for part in settings["frames"].split(", ") for number in range_of(part)}
        tasks = {name: frames_of(commands) for name, commands in words_of(job).items() if name != "simulate"}
        assert tasks.pop("check", sorted(wanted)) == sorted(wanted)
        assert [number for task in tasks.values() for number in task] == sorted(wanted)
        assert all(len(task) == settings["chunk_size"] for task in [*tasks.values()][:-1])
        assert f"--last-frame={max(wanted)}" in words_of(job)["simulate"][0]


def range_of(text):
    first, last = map(int, text.split(".."))
    return range(first, last + 1)


def test_frames_are_refused_by_the_rules_of_the_command_line():
    jobs = compiled(*(SETTINGS | {"frames": text} for text in NUMBERS))
    sentences = dict(zip(NUMBERS, map(sentence_of, jobs), strict=True))
    for text, sentence in sentences.items():
        plain = text.strip().replace("..", "-").replace(" - ", "-").replace("- ", "-")
        try:
            refusal = None if options.frame_range(plain) else ""
        except argparse.ArgumentTypeError as error:
            refusal = str(error).replace("frame, a range such as 1-24, or all", "frame, or a range such as 1-24")
        assert sentence == refusal, text
    assert sum(sentence is None for sentence in sentences.values()) == 9


@pytest.mark.parametrize("numbers", ["3", "1-6"])
@pytest.mark.parametrize("has_passes", [True, False])
def test_patterns_are_refused_by_the_rules_of_the_command_line(tmp_path, numbers, has_passes):
    patterns = [f"{tmp_path}/{name}" for name in NAMES]
    jobs = [SETTINGS | {"pattern": pattern, "frames": numbers, "passes": has_passes} for pattern in patterns]
    sentences = dict(zip(patterns, map(sentence_of, compiled(*jobs)), strict=True))
    for pattern, sentence in sentences.items():
        try:
            refusal = frames.require_pattern(pattern, len(options.frame_range(numbers)), has_passes)
        except HairError as error:
            refusal = str(error)
        assert sentence == refusal, pattern
    assert None in sentences.values() and len({*sentences.values()}) > 3


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"pattern": "//frames/f_#.exr"}, "not an absolute path"),
        ({"pattern": "frames/f_#.exr"}, "not an absolute path"),
        ({"blendfile": "/a.obj"}, "not a .blend file"),
        ({"chunk_size": 0}, "Chunk Size"),
        ({"samples": 1.5}, "Samples"),
        ({"engine": "CYCLES"}, "Engine must be vellus, cycles, eevee, not CYCLES"),
    ],
)
def test_what_workers_could_not_do_is_refused(settings, sentence):
    job = submitted(**settings)
    assert job["status"] == 400 and sentence in sentence_of(job)


def test_a_missing_setting_is_named_and_others_have_defaults():
    jobs = compiled(*({key: value for key, value in SETTINGS.items() if key != name} for name in SETTINGS))
    assert [sentence_of(job) for job in jobs] == [f"The setting {name} is missing." for name in SETTINGS]
    (words,) = words_of(submitted())["render-1"]
    assert words == ["render", "/a.blend", "--frames=1", "--out=/f_#.exr", "--engine=vellus", "--passes"]


def test_patterns_of_windows_and_variables_are_absolute():
    for pattern in ("{render}/f_#.exr", "C:\\frames\\f_#.exr", "C:/frames/f_#.exr", "\\\\server\\share\\f_#.exr"):
        assert submitted(pattern=pattern)["status"] == 200


def test_scripts_run_where_they_are_enabled():
    for is_enabled in (True, False):
        job = submitted(enable_scripts=is_enabled, frames="1-9")
        given = [parsed(words) for task in words_of(job).values() for words in task]
        assert {one.enable_scripts for one in given} == {is_enabled} and len(given) == 5


@pytest.mark.farm
def test_the_add_on_of_blender_evaluates_the_pattern(tmp_path):
    """Blender's add-on evaluates the pattern as a setting that is not editable, by Python's eval with these names."""
    settings = {setting["key"]: setting for setting in submitted()["type"]["settings"]}
    assert all(
        setting["type"] in {"string", "int32", "bool"} and setting["description"] for setting in settings.values()
    )
    pattern = settings["pattern"]
    assert pattern["editable"] is False and "visible" not in pattern
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    given = argparse.Namespace(**{key: setting.get("default") for key, setting in settings.items()})
    names = {"Path": type(tmp_path), "abspath": bpy.path.abspath, "jobname": "Shot 10", "settings": given}
    evaluated = eval(pattern["eval"], {}, names)
    assert evaluated == f"{tmp_path}/frames/Shot 10/{{timestamp}}/frame_####.exr"
    job = compiled(SETTINGS | {"pattern": evaluated}, created="2026-01-02T03:04:05", identity="ab12")[0]
    assert job["settings"]["pattern"] == f"{tmp_path}/frames/Shot 10/2026-01-02_030405-ab12/frame_####.exr"


def made_by(job):
    """Run a job's commands in this process one after another, and return the frames that they render."""
    made = []
    for words in [words for task in words_of(job).values() for words in task]:
        ended = run_here(*words, "--json")
        assert ended.status == 0, ended.errors
        made.append([result["frame"] for result in ended.results])
    return made


@pytest.mark.farm
def test_submitting_twice_makes_two_whole_jobs_and_requeue_goes_on(turning, tmp_path):  # noqa: F811
    blend = shutil.copy(turning, tmp_path / "ball.blend")
    settings = {"frames": "1-3", "chunk_size": 2, "blendfile": str(blend), "samples": 1}
    settings["pattern"] = str(tmp_path / "{timestamp}" / "f_#.exr")
    (first,), (second,) = (compiled(settings, identity=identity) for identity in ("aaaa", "bbbb"))
    folders = [frames.path_of(job["settings"]["pattern"], 1).parent for job in (first, second)]
    assert made_by(first) == [[], [1, 2], [3], []]
    (folders[0] / "f_2.exr").unlink()
    assert made_by(first) == [[], [2], [], []]
    bpy.ops.wm.save_mainfile()  # with other bytes, as the add-on does before it submits
    assert made_by(second) == [[], [1, 2], [3], []]
    for folder in folders:
        assert sorted(path.name for path in folder.glob("*.exr")) == ["f_1.exr", "f_2.exr", "f_3.exr"]
