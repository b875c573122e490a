# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated hair in a window is played, undone, baked, stopped, and deleted."""

import pytest

from tests.desktop import walks
from tools import desktop_blender

pytestmark = pytest.mark.desktop

# Strands in single precision that are bound anew to the same guides, in an object of 0.2 m.
ROUNDING = 1e-6

SIZE = (800, 500)  # of the window [pixels]: software drivers take their time for each

# Of the pixels with hair: rounding flips single samples at the edges of strands.
FLIPPED = 0.002


# Drawing, also of hair that is deleted meanwhile, is tested with both drivers; bakes and files with one.
PARTS = {"opengl": ("play", "bake", "end"), "vulkan": ("play", "vanish")}


@pytest.fixture(scope="module", params=desktop_blender.BACKENDS)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    parts = PARTS[request.param]
    return walks.take(desktop, "moving/dynamics", extension, new_profile(), request.param, parts=parts, size=SIZE)


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == []


def test_the_timeline_plays_hair_that_moves(walk):
    played = walk.facts["played"]
    assert played["frames"] == list(range(1, played["last"] + 1)) and played["last"] >= 20
    assert played["start"] == 0.0 and min(played["steps"]) > 1e-3
    assert played["picture"] > 0.1
    assert played["state"].startswith(f"Simulated up to frame {played['last']}")


def test_a_jump_shows_the_frame_as_it_was_played(walk):
    jump = walk.facts["jump"]
    assert jump["moved"] == 0.0
    assert jump["state"] == walk.facts["played"]["state"]


def test_undo_leaves_hair_where_it_was(walk):
    undo = walk.facts["undo"]
    assert undo["is_undone"]
    assert max(undo["moved"], undo["moved after a jump"], undo["at the start"]) < ROUNDING
    assert undo["picture"] < FLIPPED


@walks.with_opengl
def test_baked_frames_are_those_that_were_played(walk):
    bake = walk.facts["bake"]
    assert bake["runs"] and any(step.startswith("Frame ") for step in bake["steps"])
    assert bake["frames"] == list(range(1, 16)) and bake["state"] == "Frames 1 to 14 are baked"
    assert bake["covered"] > 0.05
    assert bake["moved"] < ROUNDING and bake["picture"] < FLIPPED


@walks.with_opengl
def test_the_present_frame_is_shown_as_it_was_baked(walk):
    assert walk.facts["bake"]["frame"] == 3 and walk.facts["bake"]["present frame"] < ROUNDING


@walks.with_opengl
def test_esc_keeps_the_frames_so_far(walk):
    stop = walk.facts["stop"]
    count = len(stop["frames"])
    assert stop["frames"] == list(range(1, count + 1)) and stop["before"] < count < 1000
    assert stop["frame"] == 12 and "are partly baked" in stop["state"]
    assert stop["moved"] < ROUNDING and stop["picture"] < FLIPPED
    assert stop["freed"] == []


def test_guides_are_deleted_while_they_play_and_come_back(walk):
    assert walk.facts["delete"] == {"goes on": True, "are gone": True, "are back": True}


def test_the_addon_is_disabled_while_it_plays(walk):
    disable = walk.facts["disable"]
    assert disable["goes on"] and disable["are finite"] and disable["state"].startswith("Simulated up to frame")


@walks.with_opengl
def test_another_file_is_opened_while_it_plays_and_while_it_is_baked(walk):
    assert walk.facts["load"] == {"while it plays": [], "while it is baked": [], "plays": True}


@walks.with_opengl
def test_baking_goes_on_after_a_redo_and_ends_with_its_window_and_the_addon(walk):
    """Baking continues after a redo and ends with its window and the add-on, and the scene is in its frame again at
    once.
    """
    ended = {"redo": True, "window closed": [False, 1], "add-on disabled": 1, "add-on enabled": [False, 1]}
    assert walk.facts["ended"] == ended
