# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair survives any operations in any order: walk_operations.py, in a process whose crash is a failure, not an end."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def check(module, run_count, operation_count, seed, limit):
    """Some operations a run; the seed fixes the ways; limit: [s]."""
    walked = subprocess.run(
        [sys.executable, "-u", "-m", f"tests.support.walk.{module}", *map(str, (run_count, operation_count, seed))],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=limit,
    )
    way = "\n".join(walked.stdout.splitlines()[-40:])
    assert walked.returncode == 0 and walked.stdout.endswith("walked\n"), f"{way}\n{walked.stderr[-4000:]}"


@pytest.mark.parametrize("counts, seed", [((3, 80), 1), pytest.param((10, 200), 3, marks=pytest.mark.long)])
def test_random_operations_raise_no_exception(counts, seed):
    check("walk_operations", *counts, seed, limit=240)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1, 11))
def test_all_operators_and_settings(seed):
    """Ten times a thousand steps, with surfaces that move, and undo, redo, saving and loading that change nothing."""
    check("walk_everything", 5, 200, seed, limit=1200)
