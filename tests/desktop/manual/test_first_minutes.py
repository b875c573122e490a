# SPDX-License-Identifier: GPL-3.0-or-later
"""A new artist's first ten minutes work in a window with a clean profile: hair in three clicks, then README's steps."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

SIZE = (1100, 700)  # of the window [pixels]: software drivers take their time for each


@pytest.fixture(scope="module", params=walks.LONG_WITH_VULKAN)
def walk(request, desktop, extension, tmp_path_factory):
    """Return the `Walk` with one backend."""
    profile = tmp_path_factory.mktemp("profile")
    return walks.take(desktop, "manual/first_minutes", extension, profile, request.param, size=SIZE)


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == []


def test_three_clicks_bring_hair_that_covers_the_cube(walk):
    """Three clicks, on the arrow of the sidebar, the Hair tab and New Hair System, bring hair that covers the cube."""
    assert (walk.facts["category"], walk.facts["surface"]) == ("Hair", "Cube")
    assert walk.facts["covered"] > 0.7


def test_strands_grow_where_the_guides_may(walk):
    assert walk.facts["roots off the mask"] == 0


def test_hair_follows_the_comb(walk):
    assert walk.facts["mode"] == "SCULPT_CURVES"
    guides_moved, hair_moved = walk.facts["combed"]
    assert guides_moved > 0.002 and hair_moved > 0.002


def test_pictures_settings_tables_and_grooms_are_written(walk):
    assert len(walk.facts["files"]) == 4 and all(walk.facts["files"].values())
