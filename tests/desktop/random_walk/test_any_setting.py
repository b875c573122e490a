# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings in random order in a window with a clean profile neither crash Blender nor raise exceptions."""

import pytest

from tests.desktop import walks
from tests.support.walk import walk_size
from tools import desktop_blender

pytestmark = pytest.mark.desktop

# Steps that one Blender takes, with one or two redraws each; the next goes on with the file that it saved.
PARTS = {"opengl": 50, "vulkan": 25}


def check(desktop, extension, profile, seed, step_count, limit, backend="opengl"):
    """Take the steps that follow from a seed; their output is in out/desktop.

    limit: of a part [s]. The steps are the same with either backend.
    """
    walk = walks.take(
        *(desktop, "random_walk/any_setting", extension, profile, backend),
        parts=[str(end) for end in [*range(PARTS[backend], step_count, PARTS[backend]), step_count]],
        more=[str(seed)],
        folder=f"any_setting_{seed}_{step_count}_{backend}",
        limit=limit,
        size=(640, 400),
    )
    walk.assert_done()
    assert walk.facts["step_count"] == step_count
    # Exceptions appear in the console alone, and the walk continues after them.
    log = walk.log
    assert "Traceback" not in log, log[max(log.index("Traceback") - 1000, 0) :][:8000]
    assert "Not freed memory blocks" not in log, log[-4000:]


def test_a_few_random_settings(desktop, extension, new_profile):
    check(desktop, extension, new_profile(), seed=1, step_count=15, limit=1200)


@pytest.mark.long
@pytest.mark.parametrize("backend", desktop_blender.BACKENDS)
@pytest.mark.parametrize("seed", walk_size.seeds(1, 5))
def test_many_random_settings(desktop, extension, new_profile, seed, backend):
    """Many random settings cause no fault; `walk_size` gives the number of steps and the seeds."""
    check(desktop, extension, new_profile(), seed, step_count=walk_size.steps(300), limit=3000, backend=backend)
