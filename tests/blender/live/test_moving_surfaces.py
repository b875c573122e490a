# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender does not carry hair that Vellus draws while its surface moves, and does before anybody else may read it."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import follow_nodes
from hair_addon.blender.host import scene_time
from hair_addon.blender.live import moving_surfaces
from tests.blender.live.test_carried_strands import bend
from tests.support.made_strands import CLOSE, drawn
from tests.support.reading import evaluated_points, points


def objects():
    return bpy.data.objects["Guides"], bpy.data.objects["Hair"]


def are_paused():
    found = {follow_nodes.is_paused(curves_object) for curves_object in objects()}
    assert len(found) == 1
    return found.pop()


def is_at_rest(hair):
    """Whether Blender's evaluation has left the strands where they are without the surface's deformation."""
    bpy.context.view_layer.update()
    return np.array_equal(evaluated_points(hair), points(hair))


def key(surface, count=8):
    """Let a surface bend more and more with the frames."""
    bend(surface, 0.0)
    block = surface.data.shape_keys.key_blocks["Bent"]
    for frame, amount in ((1, 0.1), (count, 0.9)):
        block.value = amount
        block.keyframe_insert("value", frame=frame)


@pytest.fixture
def bent(watched):
    """Hair that is drawn on a surface that bends with the frames."""
    key(watched.data.surface)
    bpy.context.scene.frame_set(1)
    drawn(watched)
    yield watched
    moving_surfaces.resume()


@pytest.fixture
def playing(bent, monkeypatch):
    """The same while the animation plays."""
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    return bent


def play(hair, *frames):
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        bpy.context.view_layer.update()
        drawn(hair)


def drag(hair, *amounts):
    for amount in amounts:
        bend(hair.data.surface, amount)
        drawn(hair)


def test_playback_leaves_blenders_strands_at_rest_and_draws_them_carried(playing):
    assert are_paused() and is_at_rest(playing)
    play(playing, 4, 6)
    shown = drawn(playing)
    assert is_at_rest(playing) and np.abs(shown - points(playing).reshape(shown.shape)).max() > 0.01
    moving_surfaces.resume()
    bpy.context.view_layer.update()
    assert not are_paused()
    np.testing.assert_allclose(shown, evaluated_points(playing).reshape(shown.shape), atol=CLOSE)
