# SPDX-License-Identifier: GPL-3.0-or-later
"""A combing stroke visits few files between the combed guides and the texture that pictures are drawn from."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import hair_cache
from tests.support.interface.visited_files import Trace
from tests.support.reading import points, write_points

# Strands are passed along, and their methods may be called from any file.
ALONG = "core/geometry/strands.py"


@pytest.fixture
def watched(hair, monkeypatch):
    """Return hair shown in a window, one of whose guides was combed before."""
    for name in ("has_window", "may_wait"):
        monkeypatch.setattr(running, name, lambda: True)
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
def test_a_stroke_visits_few_files_and_returns_to_none(watched, count, monkeypatch):
    """A stroke visits few files and returns to none, because results are passed on and not requested again; prints
    the trace.
    """
    comb(count)  # compiles kernels
    hair_cache.strands_on_gpu(watched.data)
    trace, follow_guides = Trace(), live_hair.follow_guides

    def follow(*given):
        with trace:
            follow_guides(*given)

    monkeypatch.setattr(live_hair, "follow_guides", follow)
    comb(count)
    assert trace.files
    with trace:
        hair_cache.strands_on_gpu(watched.data)
    print(f"\n{trace}")
    assert len(trace.files) <= 13
    assert not [call for call in trace.returns if call[1] != ALONG]
