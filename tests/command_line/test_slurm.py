# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of docs/farm work on Slurm: an array job on two nodes, one of which is lost during a frame."""

import contextlib
import os
import re
import signal

import pytest

from hair_addon.core.files.file_lock import claim
from tests.support.farms import farm, slurm

pytestmark = [
    pytest.mark.farm,
    pytest.mark.skipif(not slurm.IS_INSTALLED, reason="needs Slurm and MUNGE: tools/farm-packages.txt"),
]

KEPT, LOST = slurm.NODES


def test_a_lost_node_costs_one_frame(lit, tmp_path):
    shot = farm.save_shot(tmp_path / "shot.blend", samples=64)
    path = f"{farm.write_blender(tmp_path).parent}:{os.environ['PATH']}"
    steps = farm.documented(
        "Slurm", {"/farm/shot.blend": shot, "1-240": f"1-{farm.COUNT}", "--array=1-8": "--array=1-2"}
    )
    for name in ("slurm", "frames"):
        (tmp_path / name).mkdir()
    with contextlib.ExitStack() as claims, slurm.cluster(tmp_path / "slurm") as (nodes, variables):
        # Frames are claimed here until a task is to render them, as one may start long before the other.
        held = [claims.enter_context(contextlib.ExitStack()) for _frame in farm.FRAMES]
        for one, frame in zip(held, farm.FRAMES, strict=True):
            one.enter_context(claim(tmp_path / "frames" / frame))
        farm.shell(steps, tmp_path, PATH=path, **variables)
        workers = [farm.wait_for(lambda node=node: worker_on(node, shot), 300) for node in (LOST, KEPT)]
        for number, (runs, waits) in enumerate((workers, workers[::-1]), start=1):
            os.kill(waits, signal.SIGSTOP)
            os.kill(runs, signal.SIGCONT)
            held[number - 1].close()
            farm.wait_for(lambda number=number: sum(map(bool, told(tmp_path))) == number + 1, 300)
        os.kill(workers[1], signal.SIGSTOP)
        os.kill(workers[0], signal.SIGCONT)
        for one in held:
            one.close()
        lost, frame = farm.wait_for(lambda: found_in_mid_frame(shot), 300, pause=0.01)
        farm.kill([nodes[LOST].pid, *farm.parents_up_to(lost, "slurmstepd"), lost])
        assert not (tmp_path / "frames" / frame).exists()
        os.kill(workers[1], signal.SIGCONT)
        # The task of the lost node waits for two minutes before it starts again: long after the others are done.
        waiting = farm.wait_for(lambda: queued(tmp_path, variables, "--states=PENDING"), 300).split()
        farm.shell(f"scontrol update JobId={waiting[0]} StartTime=now", tmp_path, **variables)
        farm.wait_for(lambda: not queued(tmp_path, variables), 600)
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


def worker_on(node, shot):
    """Return the process that renders a shot on a node; None if there is none yet."""
    for process in farm.processes_with("SLURMD_NODENAME", node):
        if {"render", f"{shot}"} <= {*farm.arguments_of(process)[1:]}:
            return process
    return None


def found_in_mid_frame(shot):
    """Return (process, picture) of a render on the node to lose, stopped during a frame."""
    for process in farm.processes_with("SLURMD_NODENAME", LOST):
        if f"{shot}" in farm.arguments_of(process)[1:] and (frame := farm.stopped_in_mid_frame(process)):
            return process, frame
    return None
