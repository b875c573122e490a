# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that is simulated in a window: played, undone, baked, stopped, and taken away."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tools import build_extension, desktop_blender

pytestmark = pytest.mark.desktop

SCRIPT = Path(__file__).with_name("dynamics.py")
PARTS = ["play", "bake", "end"]

# Strands in single precision that are bound anew to the same guides, in an object of 0.2 m.
ROUNDING = 1e-6

# Of the pixels with hair: rounding flips single samples at the edges of strands.
FLIPPED = 0.002


class Dynamics:
    """What came of it: `facts`, and the `log`."""

    def __init__(self, folder, statuses):
        self.statuses = statuses
        self.log = "".join((folder / f"{part}.log").read_text(errors="replace") for part in PARTS)
        facts = folder / "dynamics.json"
        self.facts = json.loads(facts.read_text()) if facts.exists() else {}


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def dynamics(request, desktop, extension, new_profile):
    """The `Dynamics` with one backend; their pictures are in out/desktop."""
    folder = build_extension.ROOT / "out" / "desktop" / f"dynamics_{request.param}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    profile = new_profile()
    statuses = [
        desktop.run(
            SCRIPT,
            [part, extension, folder],
            backend=request.param,
            profile=profile,
            log=folder / f"{part}.log",
            limit=400,
        )
        for part in PARTS
    ]
    return Dynamics(folder, statuses)


def test_it_comes_to_its_end(dynamics):
    assert dynamics.statuses == [0, 0, 0] and dynamics.facts["done"] == PARTS, dynamics.log[-4000:]


def test_the_console_tells_of_no_error(dynamics):
    told = r"Vellus:|Traceback|\w*(Error|Exception)\b(?! \(0x)|<\w+>: \(EXR_ERR"
    assert [line for line in dynamics.log.splitlines() if re.match(told, line)] == []


def test_the_timeline_plays_hair_that_moves(dynamics):
    played = dynamics.facts["played"]
    assert played["frames"] == list(range(1, played["last"] + 1)) and played["last"] >= 20
    assert played["start"] == 0.0 and min(played["steps"]) > 1e-3
    assert played["picture"] > 0.1
    assert played["state"].startswith(f"Simulated up to frame {played['last']}")


def test_a_jump_shows_the_frame_as_it_was_played(dynamics):
    jump = dynamics.facts["jump"]
    assert jump["moved"] == 0.0
    assert jump["state"] == dynamics.facts["played"]["state"]


def test_undo_leaves_hair_where_it_was(dynamics):
    undo = dynamics.facts["undo"]
    assert undo["is_undone"]
    assert max(undo["moved"], undo["moved after a jump"], undo["at the start"]) < ROUNDING
    assert undo["picture"] < FLIPPED


def test_baked_frames_are_those_that_were_played(dynamics):
    bake = dynamics.facts["bake"]
    assert bake["runs"] and any(step.startswith("Frame ") for step in bake["steps"])
    assert bake["frames"] == list(range(1, 16)) and bake["state"] == "Frames 1 to 14 are baked"
    assert bake["covered"] > 0.05
    assert bake["moved"] < ROUNDING and bake["picture"] < FLIPPED


def test_the_present_frame_is_shown_as_it_was_baked(dynamics):
    assert dynamics.facts["bake"]["frame"] == 3 and dynamics.facts["bake"]["present frame"] < ROUNDING


def test_esc_keeps_the_frames_so_far(dynamics):
    stop = dynamics.facts["stop"]
    count = len(stop["frames"])
    assert stop["frames"] == list(range(1, count + 1)) and stop["before"] < count < 1000
    assert stop["frame"] == 12 and "are baked in part" in stop["state"]
    assert stop["moved"] < ROUNDING and stop["picture"] < FLIPPED
    assert stop["freed"] == []


def test_guides_are_deleted_while_they_play_and_come_back(dynamics):
    assert dynamics.facts["delete"] == {"goes on": True, "are gone": True, "are back": True}


def test_the_addon_is_disabled_while_it_plays(dynamics):
    disable = dynamics.facts["disable"]
    assert disable["goes on"] and disable["are finite"] and disable["state"].startswith("Simulated up to frame")


def test_another_file_is_opened_while_it_plays_and_while_it_is_baked(dynamics):
    assert dynamics.facts["load"] == {"while it plays": [], "while it is baked": [], "plays": True}


def test_baking_goes_on_after_a_redo_and_ends_with_its_window_and_the_addon(dynamics):
    """The scene is at its frame again at once."""
    ended = {"redo": True, "window closed": [False, 1], "add-on disabled": 1, "add-on enabled": [False, 1]}
    assert dynamics.facts["ended"] == ended
