# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's ten steps to curly hair work in a window with a clean profile."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

SIZE = (1100, 700)  # of the window [pixels]: software drivers take their time for each


# The manual's steps with both drivers; what goes beyond them is the same with any.
PARTS = {"opengl": ("cut", "curl_and_beyond"), "vulkan": ("cut", "curl")}


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, new_profile):
    """Return the `Walk` with one backend."""
    parts = PARTS[request.param]
    return walks.take(desktop, "manual/curly_hair", extension, new_profile(), request.param, parts=parts, size=SIZE)


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == []
    assert walk.facts["are finite"] and walk.facts["status"] == ""


def test_styles_are_added_by_clicks(walk):
    assert walk.facts["styles"] == ["Trim", "Fringe", "Clump", "Curl", "Frizz"]
    assert walk.facts["curled"] > 0.01 and walk.facts["points"] > 41


def test_hair_follows_the_brush_that_paints_a_mask(walk):
    assert walk.facts["painting"][0] == "PAINT_WEIGHT" and walk.facts["mode after painting"] == "OBJECT"
    assert min(walk.facts["painted"].values()) > 0.001


@walks.with_opengl
def test_keys_stay_with_a_style_that_is_moved_and_undone(walk):
    assert walk.facts["moved"] == ["Trim", "Fringe", "Curl", "Clump", "Frizz"]
    assert walk.facts["undone"] == walk.facts["styles"]
    assert walk.facts["keyed"] == walk.facts["keyed after undo"] == "Curl"


@walks.with_opengl
def test_hair_is_combed_with_its_styles_on(walk):
    assert min(walk.facts["combed with styles"].values()) > 0.001
    assert walk.facts["stay finite"]
