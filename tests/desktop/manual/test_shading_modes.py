# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenGL and Vulkan show the same hair in each of Blender's shading modes, in a window."""

import numpy as np
import pytest

from tests.desktop import walks
from tools import desktop_blender, manual_pictures

pytestmark = [pytest.mark.desktop, pytest.mark.long]

MORE = 4, 3_000  # samples per pixel, strands
BLOCK = 15  # pixels


@pytest.fixture(scope="module")
def taken(desktop, extension, new_profile):
    """Return {backend: its `Walk`}."""
    models, size = manual_pictures.SHADING_MODELS, manual_pictures.SHADING_WINDOW
    return {
        backend: walks.take(
            desktop,
            "manual/shading_modes",
            extension,
            new_profile(),
            backend,
            parts=models,
            more=map(str, MORE),
            limit=1800,
            size=size,
        )
        for backend in desktop_blender.BACKENDS
    }


def blocks_of(walk, name):
    """Return (rows, columns, 3) mean display values of blocks of a cell of the sheet."""
    left, top, right, bottom = manual_pictures.SHADING_PART
    seen = manual_pictures.read(walk.folder / f"{name}.png")[top:bottom, left:right, :3]
    return seen.reshape((bottom - top) // BLOCK, BLOCK, (right - left) // BLOCK, BLOCK, 3).mean(axis=(1, 3))


def test_both_come_to_their_end(taken):
    for walk in taken.values():
        walk.assert_done()
        assert walk.complaints() == []


@pytest.mark.parametrize("name", manual_pictures.SHADING_COLUMNS)
@pytest.mark.parametrize("model", manual_pictures.SHADING_MODELS)
def test_both_show_the_same(taken, model, name):
    """The mean of a cell of the sheet agrees within 0.1 of 255 levels, and that of each block within 2."""
    first, other = (blocks_of(walk, f"{model}_{name}") for walk in taken.values())
    off = 255.0 * (first - other)
    assert np.std(first) > 0.01  # something is shown
    assert np.abs(off.mean(axis=(0, 1))).max() < 0.1
    assert np.abs(off).max() < 2.0
