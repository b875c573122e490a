# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated guides are shown in their simulated shape, which hair follows, without changing the combed guides."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import hair_cache
from tests.support.pictures import drawn_strands
from tests.support.reading import points, write_points


@pytest.fixture(params=[False, True], ids=["background", "window"])
def followed(hair, request, monkeypatch):
    """Return (guides, hair) without a window, with handlers that act as if there were one."""
    monkeypatch.setattr(running, "has_window", lambda: request.param)
    guides = bpy.data.objects["Guides"]
    guides.data.vellus.simulates = True
    yield guides, hair
    live_hair.cancel_writing()
    invalidation.data_replaced()


def swung(guides):
    """Return (G, P, 3): the guides bent to one side."""
    moved = points(guides)
    moved[:, 1:, 0] += np.float32(0.1) * np.linspace(0.05, 1.0, moved.shape[1] - 1, dtype=np.float32) ** 2
    return moved


def show(guides, simulated):
    live_hair.show_guides(guides.data, simulated, bpy.context.evaluated_depsgraph_get())


def written(hair):
    live_hair.write_all()
    return points(hair)


def test_hair_follows_as_if_guides_were_combed_there(followed):
    guides, hair = followed
    combed, before = points(guides), written(hair)
    show(guides, swung(guides))
    simulated = written(hair)
    assert np.array_equal(points(guides), combed)
    show(guides, None)
    assert np.array_equal(written(hair), before)
    write_points(guides, swung(guides))
    assert np.array_equal(written(hair), simulated)


def test_other_settings_keep_hair_where_it_was_simulated(followed):
    guides, hair = followed
    show(guides, swung(guides))
    hair.data.vellus.hair.strand_count += 10
    bpy.context.view_layer.update()
    made = written(hair)
    show(guides, None)
    plain = written(hair)
    show(guides, swung(guides))
    assert not np.array_equal(made, plain)
    assert np.array_equal(written(hair), made)


def test_other_guides_are_shown_as_combed(followed):
    """Simulated points of a different number of guides, as after an undo, are not used."""
    guides, hair = followed
    before = written(hair)
    show(guides, swung(guides)[:-1])
    assert np.array_equal(written(hair), before)


def test_the_guides_that_are_drawn_are_simulated(followed):
    guides, _hair = followed
    show(guides, swung(guides))
    assert drawn_strands.are_drawn(drawn_strands.places(hair_cache.strands_on_gpu(guides.data)), swung(guides))


def test_undo_shows_guides_as_combed(followed):
    guides, hair = followed
    before = written(hair)
    show(guides, swung(guides))
    invalidation.data_replaced()
    assert bindings.of(hair.data) is None
    show(guides, None)
    live_hair.regenerate(hair.data, bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(written(hair), before)
