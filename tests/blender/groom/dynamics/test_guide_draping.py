# SPDX-License-Identifier: GPL-3.0-or-later
"""Drape Guides as work in steps: all or nothing, with the same result immediately and in a thread."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import guide_draping
from hair_addon.core.dynamics.collision import colliders
from hair_addon.core.errors import HairError
from hair_addon.core.grooming.guide_tool_settings import DrapeSettings
from hair_addon.core.long_work import Job, Stopped
from tests.support.reading import points

FALLING = DrapeSettings(stiffness=0.1, seconds=0.5)


def draping(guides):
    return guide_draping.draping(guides.data, FALLING, bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("last", [0.0, 0.3])
def test_esc_leaves_guides_as_they_were(guides, last):
    """Esc restores the guides, at the beginning and between frames."""
    before, told = points(guides), []

    def stop(_step, part):
        told.append(part)
        if part >= last:
            raise Stopped

    work = draping(guides)
    with pytest.raises(Stopped):
        next(work)(stop)
    work.close()
    assert np.array_equal(points(guides), before) and told == sorted(told)


def test_a_thread_comes_to_the_same_bits(guides):
    before = points(guides)
    work = draping(guides)
    job = Job(next(work))
    job.wait()
    assert np.array_equal(points(guides), before)  # written at the end
    with pytest.raises(StopIteration) as end:
        work.send(job.result())
    assert end.value.value == 60
    in_a_thread = points(guides)
    guides.data.attributes["position"].data.foreach_set("vector", before.ravel())
    assert bpy.ops.vellus.drape_guides(stiffness=0.1, seconds=0.5) == {"FINISHED"}
    assert np.array_equal(points(guides), in_a_thread)


def test_a_surface_that_cannot_be_collided_with_is_refused(guides, monkeypatch):
    """A surface without usable faces is refused, as guides would fall through it."""
    before = points(guides)
    monkeypatch.setattr(colliders, "_cause", lambda *_arguments: "its faces have no area")
    with pytest.raises(HairError, match="Guides cannot be draped on this surface: its faces have no area"):
        guide_draping.drape(guides.data, FALLING, bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(points(guides), before)


def test_more_guides_take_longer(guides):
    few, many = (guide_draping.seconds(guides.data, DrapeSettings(seconds=s), 1000) for s in (1.0, 3.0))
    assert 0.0 < few < many
