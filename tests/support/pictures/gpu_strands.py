# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair whose strands the GPU generates and deforms, as in a window on a graphics card: fixtures and drawn points."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu.strands import device_choice
from hair_addon.blender.groom import pipeline
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair, moving_surfaces
from hair_addon.blender.render import hair_cache
from tests.support.pictures import drawn_strands
from tests.support.reading import points, write_points

CLOSE = 1e-5  # [m] of strands of half a meter on a ball of one


@pytest.fixture
def window(monkeypatch):
    """Simulate a window on a graphics card, where hair is written after an interaction, on processors of any speed."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(moving_surfaces, "_TOGETHER", math.inf)
    monkeypatch.setattr(device_choice, "times", lambda: (0.0, 1.0))
    yield
    live_hair.cancel_writing()
    invalidation.data_replaced()


@pytest.fixture
def watched(hair, window):
    """Drawn and bound hair, one of whose guides was combed."""
    drawn(hair)
    comb(1)
    drawn(hair)
    live_hair.write_all()
    bpy.context.view_layer.update()
    drawn(hair)
    return hair


def comb(count, along=(0.0, 0.01, 0.02)):
    guides = bpy.data.objects["Guides"]
    combed = points(guides)
    combed[:count, 1:] += np.float32(along)
    write_points(guides, combed)


def drawn(hair):
    """Return (S, P, 3) in the texture that the shader reads, after a viewport has drawn it."""
    on_gpu = hair_cache.strands_on_gpu(hair.data)
    hair_cache.choose_makers()
    prepare()
    return drawn_strands.places(on_gpu)


def prepare():
    """Compile programs as a viewport at rest does."""
    while hair_cache.prepare_makers():
        pass


def grown(hair):
    """Return (S, P, 3) interpolated from the present guides, without caches."""
    return pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get()).points
