# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of docs/farm work on Slurm: an array job on two nodes, one of which is lost during a frame."""

import os
import re

import pytest

from tests.support.farms import farm, slurm

pytestmark = [
    pytest.mark.farm,
    pytest.mark.skipif(not slurm.IS_INSTALLED, reason="needs Slurm and MUNGE: tools/farm-packages.txt"),
]

LOST = slurm.NODES[1]


def test_a_lost_node_costs_one_frame(lit, tmp_path):
    shot = farm.save_shot(tmp_path / "shot.blend", samples=64)
    path = f"{farm.write_blender(tmp_path).parent}:{os.environ['PATH']}"
    steps = farm.documented(
        "Slurm", {"/farm/shot.blend": shot, "1-240": f"1-{farm.COUNT}", "--array=1-8": "--array=1-2"}
    )
    (tmp_path / "slurm").mkdir()
    with slurm.cluster(tmp_path / "slurm") as (nodes, variables):
        farm.shell(steps, tmp_path, PATH=path, **variables)
        farm.wait_for(lambda: [*map(bool, told(tmp_path))] == [True, True, True], 120, pause=0.01)
        lost, frame = farm.wait_for(lambda: found_in_mid_frame(shot), 60, pause=0.01)
        farm.kill([nodes[LOST].pid, *farm.parents_up_to(lost, "slurmstepd"), lost])
        assert not (tmp_path / "frames" / frame).exists()
        # The task of the lost node waits for two minutes before it starts again: long after the others are done.
        waiting = farm.wait_for(lambda: queued(tmp_path, variables, "--states=PENDING"), 90).split()
        farm.shell(f"scontrol update JobId={waiting[0]} StartTime=now", tmp_path, **variables)
        farm.wait_for(lambda: not queued(tmp_path, variables), 120)
        jobs = farm.shell("scontrol show job", tmp_path, **variables)
    assert re.findall(r"JobState=(\w+)", jobs) == ["COMPLETED"] * 3
    assert sorted(re.findall(r"Restarts=(\d)", jobs)) == ["0", "0", "1"]
    farm.require_whole(tmp_path / "frames", farm.FRAMES)
    assert farm.frames_told("\n".join(told(tmp_path))) == [*range(1, farm.COUNT + 1)]
    assert [len(farm.frames_told(text)) > 0 for text in told(tmp_path)] == [False, True, True]


def told(folder):
    """Return the output of the baking job and of each task of the rendering job."""
    return [output.read_text() for output in sorted(folder.glob("slurm-*.out"))]


def queued(folder, variables, *options):
    """Return what squeue prints about jobs that have not ended."""
    return farm.shell(f"squeue --noheader --array --format=%i {' '.join(options)}", folder, **variables)


def found_in_mid_frame(shot):
    """Return (process, picture) of a render on the node to lose, stopped during a frame."""
    for process in farm.processes_with("SLURMD_NODENAME", LOST):
        if f"{shot}" in farm.arguments_of(process)[1:] and (frame := farm.stopped_in_mid_frame(process)):
            return process, frame
    return None
