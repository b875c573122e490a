# SPDX-License-Identifier: GPL-3.0-or-later
"""Composite Hair in a window is rendered, animated, undone, copied, reopened and disabled, and a groom is exported."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

# Of display colors: 8 bits per channel, and the rounding of nodes that add zero.
ROUNDING = 0.5 / 255.0


# Pictures are rendered with both drivers; scenes, files and the viewport's lens are the same with any.
PARTS = {"opengl": ("all",), "vulkan": ("renders",)}


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    parts = PARTS[request.param]
    return walks.take(desktop, "composite", extension, new_profile(), request.param, parts=parts, size=(640, 400))


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    # Messages of the add-on about the emptied hair are no errors.
    assert [line for line in walk.complaints() if not line.startswith("Vellus:")] == []
    assert "Not freed memory blocks" not in walk.log, walk.log[-4000:]


def test_it_is_turned_on_undone_and_redone(walk):
    assert walk.facts["on"] == walk.facts["redone"] == [True, True]
    assert walk.facts["undone"] == [False, False]
    assert walk.facts["changed"] > 2.0 * ROUNDING


def test_frames_of_an_animation_have_their_hair(walk):
    first, second = walk.facts["frames"]
    assert first < ROUNDING < second


def test_a_file_that_is_opened_beside_a_render_is_as_it_was_saved(walk):
    assert walk.facts["opened"] == [True, True] and walk.facts["as before"] < ROUNDING


@walks.with_opengl
def test_a_copied_scene_has_hair_of_its_own(walk):
    copy = walk.facts["copy"]
    assert copy["has its own"] and copy["scenes"] == 4
    assert copy["picture"] < ROUNDING
    assert copy["without its scene"] == [False, False]


@walks.with_opengl
def test_without_the_add_on_and_turned_off_cycles_renders_its_own_hair(walk):
    assert walk.facts["enabled"] == [True, True]
    assert max(walk.facts["disabled"], walk.facts["off"]) < ROUNDING


@walks.with_opengl
def test_what_is_out_of_focus_is_blurred_in_the_viewport(walk):
    sharp, blurred = walk.facts["shown"]
    assert blurred > 1.15 * sharp > 0.0


@walks.with_opengl
def test_the_dialog_exports_a_groom(walk):
    assert walk.facts["exported"] > 100_000 and walk.facts["frame"] == 1
