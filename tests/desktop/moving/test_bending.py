# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a bending surface in a window: Blender's evaluation is paused until the surface rests."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

# Of the pixels with hair: rounding flips single samples at the edges of strands.
FLIPPED = 0.002

SIZE = (640, 400)  # of the window [pixels]: software drivers take their time for each


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    return walks.take(desktop, "moving/bending", extension, new_profile(), request.param, size=SIZE)


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == []


def test_blender_leaves_hair_out_while_the_surface_moves(walk):
    facts = walk.facts
    assert facts["playing"] == facts["dragged"] == facts["previewed"] == [True, 0.0]
    for moment in ("stopped", "beside Workbench", "rested", "in Solid again"):
        is_left_out, moved = facts[moment]
        assert not is_left_out and moved > 0.01, moment


def test_view_selected_finds_hair_that_is_left_out(walk):
    assert max(map(abs, walk.facts["view"])) < 0.1  # the ball stands at the origin


def test_the_window_shows_what_it_shows_at_rest(walk):
    facts = walk.facts
    assert facts["frame"] == facts["stopped_frame"]
    assert facts["covered"] > 0.02 and facts["differ"] < FLIPPED
