# SPDX-License-Identifier: GPL-3.0-or-later
"""A visit to another time ends at the scene's own time."""

import bpy
import pytest

from hair_addon.blender.host import scene_time


@pytest.fixture
def at_frame_7(scene):
    scene.frame_set(7, subframe=0.25)
    return scene


def test_moments_are_visited_in_turn_and_the_scene_comes_back(at_frame_7):
    seen = []
    for index in scene_time.visit(at_frame_7, [0.0, -1.5, 0.5], at_frame_7.frame_set):
        seen.append((index, at_frame_7.frame_current_final))
    assert seen == [(0, 7.25), (1, 5.75), (2, 7.75)]
    assert at_frame_7.frame_current_final == 7.25


def test_its_own_frame_is_gone_to_between_others(at_frame_7):
    """A visit sets the scene's own time again between other motion samples."""
    visit = scene_time.visit(at_frame_7, [-0.5, 0.0, 0.5], at_frame_7.frame_set)
    assert [at_frame_7.frame_current_final for _ in visit] == [6.75, 7.25, 7.75]


def test_a_visit_that_is_broken_off_comes_back(at_frame_7):
    visit = scene_time.visit(at_frame_7, [-1.0, 1.0], at_frame_7.frame_set)
    next(visit)
    assert at_frame_7.frame_current_final == 6.25
    visit.close()
    assert at_frame_7.frame_current_final == 7.25


def test_who_stays_in_a_frame_sets_none(at_frame_7):
    calls = []
    assert list(scene_time.visit(at_frame_7, [0.0], lambda *_, **__: calls.append(1))) == [0]
    assert calls == []


def test_data_may_be_written_for_a_viewport(at_frame_7):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert scene_time.is_shown(depsgraph) and not scene_time.is_rendered(depsgraph)
    assert scene_time.may_write(at_frame_7, depsgraph)
