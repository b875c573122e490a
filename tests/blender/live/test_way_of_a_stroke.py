# SPDX-License-Identifier: GPL-3.0-or-later
"""The way of a stroke of the comb, from guides that were combed to the texture that pictures are drawn from: short."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import hair_cache
from tests.support.interface.ways import Way
from tests.support.reading import points, write_points

# Data that goes along has its own methods: whoever is handed strands asks them.
ALONG = "core/geometry/strands.py"


@pytest.fixture
def watched(hair, monkeypatch):
    """Hair in a window that shows it, of whose guides one was combed already."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    hair_cache.strands_on_gpu(hair.data)
    comb(1)
    hair_cache.strands_on_gpu(hair.data)
    yield hair
    live_hair.cancel_writing()
    invalidation.data_replaced()


def comb(count):
    guides = bpy.data.objects["Guides"]
    combed = points(guides)
    combed[:count, 1:] += np.float32([0.0, 0.0, 1e-3])
    write_points(guides, combed)


@pytest.mark.parametrize("count", [1, 60])
def test_a_stroke_passes_few_files_and_comes_back_to_none(watched, count, monkeypatch):
    """Printed: all of it. What is drawn is handed over, and not asked for again."""
    comb(count)  # compiles what is compiled once
    hair_cache.strands_on_gpu(watched.data)
    way, follow_guides = Way(), live_hair.follow_guides

    def follow(*given):
        with way:
            follow_guides(*given)

    monkeypatch.setattr(live_hair, "follow_guides", follow)
    comb(count)
    assert way.places
    with way:
        hair_cache.strands_on_gpu(watched.data)
    print(f"\n{way}")
    assert len(way.places) <= 13
    assert not [call for call in way.returns if call[1] != ALONG]
