# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of a style's number is added by its button in a window, painted and undone; one of the color is painted too."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    return walks.take(desktop, "maps", extension, new_profile(), request.param, size=(760, 540))


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.facts["status"] == "" and walk.complaints() == []


def test_the_button_adds_a_map_and_paint_enters_its_mode(walk):
    assert walk.facts["clicked"] and walk.facts["mode"] == "PAINT_WEIGHT"
    found = walk.facts["white"]
    assert found["high where white"] == found["white"] == 400


@pytest.mark.parametrize("name", ["painted", "redone", "again"])
def test_painted_strands_have_their_value(walk, name):
    """Strands where the map is black and white are those of hair with the values at From and To."""
    found = walk.facts[name]
    assert found["low where black"] == found["black"] > 20
    assert found["high where white"] == found["white"] > 100


def test_a_stroke_is_undone_and_redone(walk):
    assert walk.facts["undone"] == walk.facts["white"] and walk.facts["is redone"]


def test_a_ramp_turns_the_values_around_and_is_undone(walk):
    facts = walk.facts
    assert facts["same with a ramp"] < 1e-6 and facts["ramps"] == 1
    assert facts["turned"] == [facts["painted"]["white"], facts["painted"]["black"]]
    assert facts["is without a ramp"] and facts["ramp undone"] == 0.0


def test_a_coat_is_painted_on_an_image(walk):
    """Strands under the stroke are red, others stay green, in the picture and in the hair's Curves; undo and redo."""
    facts = walk.facts
    assert facts["coat mode"] == "PAINT_TEXTURE"
    assert facts["red"] > 20 and facts["green"] > 100
    assert facts["is stored"] and facts["coat undone"] and facts["coat redone"]


def test_strands_are_generated_again_by_the_redo_panel(walk):
    assert [walk.facts[f"{count} strands"] for count in (300, 400)] == [300, 400]
