# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings in random order in a window with a clean profile: Blender comes to the end, and nothing raises."""

import json
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = Path(__file__).with_name("any_setting.py")

# Steps that one Blender takes, with one or two redraws each; the next goes on with the file that it saved.
PARTS = {"opengl": 50, "vulkan": 25}


def check(desktop, extension, profile, seed, step_count, limit, backend="opengl"):
    """Take the steps that follow from a seed; what was printed is in out/desktop.

    limit: of a part [s]. The steps are the same with either backend.
    """
    folder = build_extension.ROOT / "out" / "desktop" / f"any_setting_{seed}_{step_count}_{backend}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    told = []
    for end in [*range(PARTS[backend], step_count, PARTS[backend]), step_count]:
        path = folder / f"any_setting_{end}.log"
        status = desktop.run(
            SCRIPT,
            [str(seed), str(end), folder, extension],
            backend=backend,
            profile=profile,
            log=path,
            limit=limit,
            size=(640, 400),
        )
        log = path.read_text(errors="replace")
        report = json.loads((folder / f"any_setting_{seed}.json").read_text())
        assert status == 0 and report["is_done"] and report["step_count"] == end, log[-4000:]
        told.append(log)
    # What raises is in the console alone, and the walk goes on after it.
    told = "".join(told)
    assert "Traceback" not in told, told[max(told.index("Traceback") - 1000, 0) :][:8000]
    assert "Not freed memory blocks" not in told, told[-4000:]


def test_a_few_random_settings(desktop, extension, new_profile):
    check(desktop, extension, new_profile(), seed=1, step_count=15, limit=300)


@pytest.mark.long
@pytest.mark.parametrize("backend", desktop_blender.BACKENDS)
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_many_random_settings(desktop, extension, new_profile, seed, backend):
    check(desktop, extension, new_profile(), seed, step_count=300, limit=1200, backend=backend)
