# SPDX-License-Identifier: GPL-3.0-or-later
"""A haircut that is combed in a layer stays when the head is remeshed and the guides are doubled."""

import numpy as np
import pytest

from tests.desktop import walks

pytestmark = [pytest.mark.desktop, pytest.mark.long]


@pytest.fixture(scope="module")
def walk(desktop, extension, new_profile):
    """Return the `Walk` with OpenGL."""
    return walks.take(desktop, "haircuts/remeshed", extension, new_profile(), "opengl", size=(560, 440))


def test_combing_stays_on_another_mesh_with_twice_the_guides(walk):
    """Guides of the new mesh are nearer to the combed guides than to uncombed ones, as near as combed neighbors are."""
    walk.assert_done()
    facts = walk.facts
    assert facts["guides"] == 800 and facts["status"] == ["", ""] and facts["vertices"][0] != facts["vertices"][1]
    combed, uncombed, neighbors = (
        np.median(facts[name]) for name in ("from combed", "from uncombed", "between neighbors")
    )
    assert combed < 0.85 * uncombed and combed < 1.2 * neighbors
