# SPDX-License-Identifier: GPL-3.0-or-later
"""Disabling the add-on while a window renders waits for the end with a message; Blender does not hang."""

import bpy
import numpy as np
import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop

SAID = "Vellus: Blender renders: Vellus is disabled when the render has ended."


@pytest.fixture(scope="module")
def walk(desktop, extension, new_profile):
    """Return the `Walk` with one backend, as only Blender's threads matter."""
    return walks.take(desktop, "disabled", extension, new_profile(), "opengl", size=(640, 400))


def pixels(path):
    image = bpy.data.images.load(str(path))
    found = np.array(image.pixels, np.float32).reshape(-1, 4)
    bpy.data.images.remove(image)
    return found


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert walk.complaints() == [SAID] * 2
    assert "Not freed memory blocks" not in walk.log, walk.log[-4000:]


def test_it_is_disabled_when_the_render_has_ended(walk):
    disable = walk.facts["disable"]
    assert disable["renders on"] and disable["there"] == [True, True] and disable["rendered"]
    assert disable["handled"] > 3
    assert disable["then there"] == [False, False] and not disable["listed"]


def test_a_render_warns_of_a_damaged_image(walk):
    assert any("missing or damaged" in one and "damaged.png" in one for one in walk.facts["disable"]["reports"])


def test_what_is_enabled_again_meanwhile_stays(walk):
    enable = walk.facts["enable"]
    assert enable["renders on"] and enable["there"] == enable["then there"] == [True, True] and enable["rendered"]


def test_both_renders_are_whole(walk):
    first, second = (pixels(walk.folder / f"{name}.png") for name in ("disabled", "enabled"))
    assert (first[:, 3] > 0.5).mean() > 0.05
    np.testing.assert_allclose(first, second, atol=2.0 / 255.0)
