# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair survives any operations in any order, in a separate process whose crash is a failure: walk_operations.py."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.walk import walk_size

RUN = 200  # steps from an empty file
SECONDS = 1.2  # of a step, where other processes take most of the machine

ROOT = Path(__file__).resolve().parents[2]


def check(module, run_count, operation_count, seed, limit):
    """Run some operations; the seed fixes the walk; limit: [s]."""
    walked = subprocess.run(
        [sys.executable, "-u", "-m", f"tests.support.walk.{module}", *map(str, (run_count, operation_count, seed))],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=limit,
    )
    way = "\n".join(walked.stdout.splitlines()[-40:])
    # Hypothesis also lists the steps, which the way has.
    said = "\n".join(line for line in walked.stderr.splitlines() if not line.startswith("state."))
    assert walked.returncode == 0 and walked.stdout.endswith("walked\n"), f"{way}\n{said[-4000:]}"


@pytest.mark.parametrize("counts, seed", [((3, 80), 1), pytest.param((10, 200), 3, marks=pytest.mark.long)])
def test_random_operations_raise_no_exception(counts, seed):
    check("walk_operations", *counts, seed, limit=1200)


@pytest.mark.long
@pytest.mark.parametrize("seed", walk_size.seeds(1, 10))
def test_all_operators_and_settings(seed):
    """A thousand random steps per seed, on moving surfaces, keep the invariants, and undo and loading change
    nothing.

    How many of which seeds: `walk_size`.
    """
    count = walk_size.steps(1000)
    check("walk_everything", max(count // RUN, 1), min(count, RUN), seed, limit=60 + SECONDS * count)
