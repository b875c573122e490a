# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms applied to a head in a window do not change the picture of its hair."""

import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

# Of the pixels with hair: rounding flips single samples at the edges of strands.
FLIPPED = 0.02

SIZE = (640, 400)  # of the window [pixels]: software drivers take their time for each


@pytest.fixture(scope="module")
def walk(desktop, extension, new_profile):
    """Return the `Walk` with OpenGL, as the surface is read in the same way with any driver."""
    return walks.take(desktop, "moving/applied_transforms", extension, new_profile(), "opengl", size=SIZE)


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == []


@pytest.mark.parametrize("change", ["all_transforms", "set_origin", "mirrored", "rig"])
def test_the_picture_stays(walk, change):
    covered, differ, statuses = walk.facts[change]
    assert covered > 0.02 and differ < FLIPPED and not any(statuses)
