# SPDX-License-Identifier: GPL-3.0-or-later
"""The job type works in a real Flamenco, in the folder VELLUS_FLAMENCO, with a manager and two workers."""

from pathlib import Path

import bpy
import pytest

from tests.support.farms import farm, flamenco

pytestmark = [
    pytest.mark.farm,
    pytest.mark.skipif(flamenco.FOLDER is None, reason="needs Flamenco: VELLUS_FLAMENCO is the folder of its programs"),
]

JOBS = [
    {"frames": "1-5, 9", "chunk_size": 2},
    {"frames": "1, 2, -3..-1", "passes": False, "transparent": True, "samples": 3, "enable_scripts": True},
    {"frames": "7", "simulate": False, "pattern": "{jobs}/f.png", "passes": False},
    {"frames": "1 6"},
    {"frames": "6-1"},
    {"frames": "1-6", "pattern": "/frames/f.exr"},
    {"pattern": "/frames/f_#.png"},
    {"pattern": "//frames/f_#.exr"},
    {"engine": "blender"},
    {"chunk_size": 0},
]


@pytest.fixture(scope="module")
def manager(tmp_path_factory):
    """Return a manager for the workers of this module."""
    folder = tmp_path_factory.mktemp("manager")
    with flamenco.manager(folder, farm.write_blender(folder)) as asked:
        yield asked


@pytest.mark.parametrize("given", JOBS, ids=str)
def test_the_mock_answers_as_the_manager_does(manager, given):
    settings = {"frames": "1-4", "pattern": "/frames/{timestamp}/f_####.exr", "blendfile": "/a.blend"} | given
    status, answer = manager.submit(settings, initial_status="paused")
    if status != 200:
        (mocked,) = flamenco.compiled(settings)
        assert (status, mocked["status"]) == (400, 400)
        sentences = [told["message"].rpartition(" at refuse")[0] for told in (answer, mocked)]
        assert "{timestamp}" not in sentences[0] and sentences[0][-30:] == sentences[1][-30:]
        return
    (mocked,) = flamenco.compiled(settings, **flamenco.identity_of(answer))
    assert mocked["status"] == 200 and answer["settings"] == mocked["settings"]
    tasks = manager.tasks(answer)
    assert [(task["name"], task["task_type"]) for task in tasks] == [
        (task["name"], task["type"]) for task in mocked["tasks"]
    ]
    assert [[(command["name"], command["parameters"]) for command in task["commands"]] for task in tasks] == [
        [(command["name"], command["parameters"]) for command in task["commands"]] for task in mocked["tasks"]
    ]


def test_jobs_are_whole_after_a_lost_worker_a_second_submission_and_requeue(manager, lit, tmp_path):
    shots = [tmp_path / name / "shot.blend" for name in ("one", "two")]
    shots[0].parent.mkdir()
    farm.save_shot(shots[0], samples=64)
    settings = {
        "frames": f"1..3, 4 - {farm.COUNT}",
        "chunk_size": 2,
        "pattern": str(tmp_path / "{timestamp}" / "shot_####.exr"),
    }
    homes = [tmp_path / name for name in flamenco.WORKERS]
    with flamenco.worker(manager, homes[0]):
        status, first = manager.submit(settings | {"blendfile": str(shots[0])})
        assert status == 200
        with flamenco.worker(manager, homes[1]) as worker:
            lost, frame = farm.wait_for(lambda: found_in_mid_frame(homes[1]), 120, pause=0.01)
            farm.kill([worker.pid, lost])
        assert not (folder_of(first) / frame).exists()
        with flamenco.worker(manager, homes[1]):  # started again, as by the machine
            assert manager.wait(first) == "completed"
            farm.require_whole(folder_of(first), farm.FRAMES)
            assert farm.frames_told(manager.log(first)) == [*range(1, farm.COUNT + 1)]
            shots[1].parent.mkdir()
            bpy.ops.wm.save_as_mainfile(filepath=str(shots[1]))  # with other bytes, as by the add-on
            second = manager.submit(settings | {"blendfile": str(shots[1])})[1]
            assert manager.wait(second) == "completed"
            farm.require_whole(folder_of(second), farm.FRAMES)
            requeue_goes_on(manager, first)
    assert folder_of(first) != folder_of(second)


def requeue_goes_on(manager, job):
    (folder_of(job) / farm.FRAMES[3]).unlink()
    assert manager.ask(f"jobs/{job['id']}/setstatus", {"status": "requeueing", "reason": "a test"})[0] == 204
    farm.wait_for(lambda: manager.status(job) != "completed", 30)
    assert manager.wait(job) == "completed"
    farm.require_whole(folder_of(job), farm.FRAMES)
    assert farm.frames_told(manager.log(job)) == sorted([*range(1, farm.COUNT + 1), 4])


def folder_of(job):
    """Return the folder of a job's images."""
    return Path(job["settings"]["pattern"]).parent


def found_in_mid_frame(home):
    """Return (process, picture) of a worker's render, stopped during a frame."""
    for process in farm.processes_with("FLAMENCO_HOME", home):
        if "render" in farm.arguments_of(process) and (frame := farm.stopped_in_mid_frame(process)):
            return process, frame
    return None
