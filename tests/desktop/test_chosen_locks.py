# SPDX-License-Identifier: GPL-3.0-or-later
"""Locks in a window lie around the guides that are chosen by clicks."""

import pytest

from tests.desktop import walks

pytestmark = [pytest.mark.desktop, pytest.mark.long]


def test_locks_lie_around_clicked_guides(desktop, extension, new_profile):
    """Locks follow a selection that is saved again in Sculpt Mode, and undo."""
    walk = walks.take(desktop, "chosen_locks", extension, new_profile(), "opengl", size=(560, 440))
    walk.assert_done()
    assert walk.complaints() == []
    facts = walk.facts
    assert facts["saved"] == facts["clicked"] and len(facts["saved"]) == 5
    assert facts["automatic"] > 40 and facts["changed pixels"] > 0.05
    for found in ("chosen", "others", "undone"):
        assert facts[found]["status"] == "" and facts[found]["at nearest"] > 0.99 and facts[found]["tips"] < 0.7
    assert facts["chosen"]["count"] == facts["chosen"]["guides"] == 5
    assert facts["others"]["count"] == facts["others"]["guides"] == 35
    assert facts["undone"] == pytest.approx(facts["chosen"])
