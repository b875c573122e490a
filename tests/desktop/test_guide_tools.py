# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide tools work in a window, each from its menu, redone and undone, and so do unstyled combing, tubes and the
library.
"""

import numpy as np
import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

TOOLS = (
    *("guide_length", "trim_guides", "smooth_guides", "lift_guides", "attract_guides", "drape_guides"),
    *("change_guide_count", "mirror_guides", "copy_guide_shape"),
)


PARTS = {"opengl": ("all",), "vulkan": ("tools", "drawn")}


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    parts = PARTS[request.param]
    return walks.take(desktop, "guide_tools", extension, new_profile(), request.param, parts=parts, size=(760, 540))


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.facts["status"] == "" and walk.complaints() == []


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_of_the_menu_is_redone_and_undone(walk, name):
    done = walk.facts["tools"][name]
    assert (done["ran"], done["mode"]) == (f"VELLUS_OT_{name}", "SCULPT_CURVES")
    assert done["is changed"] and done["is redone"] and done["are others kept"]
    assert done["is undone"] and done["is done again"]


@pytest.mark.parametrize("name", TOOLS)
def test_hair_follows_the_tool_and_its_undo(walk, name):
    done = walk.facts["tools"][name]
    assert done["hair moved"] > 0.01
    assert max(done["hair after undo"], done["hair after redo"]) < 1e-5


def test_hair_is_straight_while_it_is_combed(walk):
    assert walk.facts["is straight in the stroke"] and walk.facts["is styled again"]
    assert min(walk.facts["straightened"], *walk.facts["combed"], walk.facts["styled again"]) > 1e-3


def test_combing_shows_hidden_guides(walk):
    """Combing shows hidden guides: the brush moves them, and hair follows."""
    shown = [walk.facts[name] for name in ("were shown", "are shown", "combing mode")]
    assert shown == [False, True, "SCULPT_CURVES"] and min(walk.facts["combed"]) > 1e-3


def test_tubes_are_made_after_the_dialog_and_redone(walk):
    made = walk.facts["tubes"]
    assert made["asked"] == ["RUNNING_MODAL"] and made["before it is confirmed"] == 0
    assert made["made"] > made["redone"] > 0 == made["undone"]


def test_a_groom_that_was_saved_is_in_the_shelf_and_a_click_applies_it(walk):
    counts = walk.facts["shelf"]
    assert counts["applied"] == counts["before"] + 1 and counts["undone"] == counts["before"]


def test_flow_is_painted_by_the_mouse(walk):
    """A stroke of the tool turns guides while the mouse moves; it is redone, undone and canceled. F sizes the brush."""
    flow = walk.facts["flow"]
    assert flow["ran"] == "VELLUS_OT_paint_flow" and flow["points"] > 3 and flow["changed"] > 2
    assert flow["in the stroke"][0] > 0.05 and flow["is the same at once"] < 1e-5
    assert flow["radius"] == pytest.approx(1.0)
    brush = walk.facts["brush"]
    assert brush["radius before"] == pytest.approx(0.12)  # fits the surface before the first stroke
    assert brush["radius moved"] > 0.0 and brush["radius changed"] == brush["radius moved"]
    assert brush["strength moved"] > 0.0 and brush["strength changed"] == 0.0
    assert flow["without strength"] and flow["is undone"] and flow["is canceled"] and not flow["second stroke"]


def test_a_tie_is_drawn_by_the_mouse_off_the_surface(walk):
    tie = walk.facts["tie"]
    (line,) = tie["lines"]
    assert np.linalg.norm(line[0]) == pytest.approx(1.0, abs=0.05) and np.linalg.norm(line[-1]) > 1.3
    assert tie["is stopped"] and tie["gathered"] > 40 and tie["is undone"]
