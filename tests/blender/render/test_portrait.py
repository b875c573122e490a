# SPDX-License-Identifier: GPL-3.0-or-later
"""On the sample head, eyes behind their lids look at a point, and brows and lashes are on the skin."""

import bpy
import numpy as np
import pytest
from mathutils.bvhtree import BVHTree

from blend_samples.heads import eyes, head, portrait
from hair_addon import api
from tests.support import reading

TARGET = np.array([0.3, -1.0, 0.74])


@pytest.fixture(scope="module")
def samples():
    """Return (the dressed head, its earlier vertex positions)."""
    built = head.build()
    before = places(built)
    portrait.dress(built, TARGET)
    return built, before


def places(mesh_object):
    """Return (V, 3), a mesh object's own vertices."""
    positions = np.empty((len(mesh_object.data.vertices), 3), np.float32)
    mesh_object.data.vertices.foreach_get("co", positions.ravel())
    return positions


def halves(positions):
    """Return the left and the right objects."""
    return positions[positions[:, 0] > 0.0], positions[positions[:, 0] < 0.0]


def test_a_face_leaves_the_head_as_it_is(samples):
    built, before = samples
    np.testing.assert_array_equal(places(built), before)


def test_eyes_are_behind_their_lids_and_fill_the_hole(samples):
    built, _before = samples
    for opening, ball in zip(eyes.openings(built), halves(places(bpy.data.objects["Eyes"])), strict=True):
        border = np.concatenate([opening.upper, opening.lower])
        assert np.ptp(border[:, 0]) > 0.02  # both corners were found
        sphere_front = [ball[np.argsort(np.hypot(*(ball - place)[:, [0, 2]].T))[:8], 1].min() for place in border]
        gaps = np.array(sphere_front) - border[:, 1]
        assert gaps.min() > 0.0
        assert np.median(gaps) < 0.003


def test_lids_reach_from_their_edge_to_the_eyeball(samples):
    built, _before = samples
    parts = (*(halves(places(bpy.data.objects[name])) for name in ("Eyes", "Lids")), eyes.openings(built))
    for ball, lid, opening in zip(*parts, strict=True):
        rings = lid.reshape(3, -1, 3)  # from the edge inward
        border = np.concatenate([opening.upper, opening.lower])
        to_edge = np.linalg.norm(rings[:2].reshape(-1, 1, 3) - border, axis=2).min(axis=0)
        assert to_edge.max() < 0.002
        center = ball[-64:].mean(axis=0) + eyes.RADIUS * gaze_of(ball)
        assert np.linalg.norm(rings[2] - center, axis=1).max() < eyes.RADIUS


def gaze_of(ball):
    """Return the direction from an eyeball's back pole to its pupil."""
    gaze = ball[:64].mean(axis=0) - ball[-64:].mean(axis=0)
    return gaze / np.linalg.norm(gaze)


def test_both_eyes_look_at_the_point(samples):
    for ball in halves(places(bpy.data.objects["Eyes"])):
        towards = TARGET - ball[-64:].mean(axis=0)
        cosine = gaze_of(ball) @ towards / np.linalg.norm(towards)
        assert cosine > 0.9999


@pytest.mark.parametrize("name", ["Brows", "Lashes"])
def test_brows_and_lashes_grow_out_of_the_skin(name, samples):
    built, _before = samples
    skin = BVHTree.FromObject(built, bpy.context.evaluated_depsgraph_get())
    roots = api.points(bpy.data.objects[name])[:, 0]
    away = [skin.find_nearest(root.tolist())[3] for root in roots[::7]]
    assert max(away) < 0.001
    assert all(len(half) > 0.4 * len(roots) for half in halves(roots))


def test_hair_covers_the_nape():
    """Behind the neck, the middle has at least half as many guides as the sides, so that the collar does not show."""
    built = head.build()
    portrait.bust.build(built)
    guides, _hair = portrait.grow(built, strand_count=20)
    combed = reading.points(guides)
    for height in (0.66, 0.63, 0.60):
        is_crossing = (combed[:, :-1, 2] >= height) & (combed[:, 1:, 2] < height) & (combed[:, 1:, 1] > 0.0)
        counts, _edges = np.histogram(combed[:, 1:, 0][is_crossing], bins=np.linspace(-0.09, 0.09, 4))
        assert counts[1] > 0.5 * counts[[0, 2]].mean()
