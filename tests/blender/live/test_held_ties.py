# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathered hair is held up to its tie while it is simulated: in playback and in baked frames alike."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import gathered_groups, simulated_guides
from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.core.long_work import run_now
from tests.support.dynamics.following import update
from tests.support.dynamics.swung import simulate
from tests.support.exchange.imported import select
from tests.support.reading import points

TAIL = ((0.0, 0.6, 0.8), (0.0, 0.9, 1.1), (0.0, 1.3, 0.6), (0.0, 1.3, -1.0))


@pytest.fixture
def tied(hair, tmp_path, monkeypatch):
    """Return guides in a ponytail on a head that turns within six frames and then rests, as in a window."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    guides, head = bpy.data.objects["Guides"], bpy.data.objects["Sphere"]
    api.change_guides(guides, "LENGTH", method="SET", length=3.0)
    data = bpy.data.curves.new("Tie", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    spline.points.add(len(TAIL) - 1)
    for point, place in zip(spline.points, TAIL, strict=True):
        point.co = (*place, 1.0)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Tie", data))
    bpy.context.view_layer.update()
    sizes = {"tie_radius": 0.05, "tail_radius": 0.08, "clearance": 0.02}
    api.change_guides(guides, "GATHER", line="Tie", **sizes)
    for frame, angle in ((1, 0.0), (7, 0.5)):
        head.rotation_euler.z = angle
        head.keyframe_insert("rotation_euler", frame=frame)
    simulate(guides, tmp_path, collides_with_surface=False)
    yield guides
    live_hair.cancel_writing()
    invalidation.clear()


def shown_at(guides, frame):
    """Return the simulated guides at a frame, in the coordinates of the head."""
    for number in range(1, frame + 1):
        bpy.context.scene.frame_set(number)
    return simulated_guides.point_cache.get(guides.data.session_uid).copy()


def before_ties(guides, combed):
    """Return (G, P) bool: the points of guides before their ties."""
    held = np.array([value.value for value in guides.data.attributes["gathered_held"].data])
    assert (held > 0.0).all() and (held < 1.0).any()
    lengths = np.linalg.norm(np.diff(combed, axis=1), axis=2)
    along = (
        np.concatenate([np.zeros((len(combed), 1)), np.cumsum(lengths, axis=1)], axis=1) / lengths.sum(axis=1)[:, None]
    )
    return along <= held[:, None]


def test_hair_follows_the_head_up_to_its_tie_and_swings_behind_it(tied):
    combed = points(tied)
    is_before = before_ties(tied, combed)
    assert (np.linalg.norm(combed - TAIL[0], axis=2).min(axis=1) < 0.3).mean() > 0.9
    played = shown_at(tied, 7)
    apart = np.linalg.norm(played - combed, axis=2)
    assert apart[is_before].max() < 1e-4
    is_long = is_before.mean(axis=1) < 0.6
    assert is_long.sum() > 5 and apart[is_long, -1].min() > 0.02
    run_now(guide_baking.baking([tied.data], 7, bpy.context.scene))
    bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_set(7)
    assert np.array_equal(simulated_guides.point_cache.get(tied.data.session_uid), played)


def test_the_setting_releases_hair(tied):
    tied.data.vellus.dynamics.holds_ties = False
    combed = points(tied)
    apart = np.linalg.norm(shown_at(tied, 7) - combed, axis=2)
    assert apart[before_ties(tied, combed)].max() > 0.01


def held_lengths(guides):
    """Return (parts (G,) of the lengths up to ties, lengths (G,) of guides) in the world."""
    placed = points(guides) * np.array(guides.matrix_world.to_scale())
    lengths = np.linalg.norm(np.diff(placed, axis=1), axis=2).sum(axis=1)
    return gathered_groups.read(guides.data).held, lengths


def test_hair_is_held_up_to_its_tie_after_it_is_cut(tied):
    """Guides that are cut behind their ties are held at the same place; guides cut before them are held as a whole."""
    before, lengths = held_lengths(tied)
    is_behind = before < 1.0
    cut = float(np.median((before * lengths)[is_behind]))
    api.change_guides(tied, "LENGTH", method="MAXIMUM", length=cut)
    now, shorter = held_lengths(tied)
    expected = np.minimum(before * lengths / shorter, 1.0)
    np.testing.assert_allclose(now[is_behind], expected[is_behind], atol=2e-3)
    assert 0 < (expected[is_behind] == 1.0).sum() < is_behind.sum() and abs(now - before)[is_behind].max() > 0.1
    np.testing.assert_array_equal(now[~is_behind], 1.0)


def tie_places(guides):
    """Return positions (G, 3) of ties in the world."""
    placed = points(guides) @ np.array(guides.matrix_world)[:3, :3].T + np.array(guides.matrix_world.translation)
    steps = np.linalg.norm(np.diff(points(guides), axis=1), axis=2)
    along = np.insert(np.cumsum(steps, axis=1), 0, 0.0, axis=1)
    held = gathered_groups.read(guides.data).held * along[:, -1]
    return np.stack(
        [[np.interp(*of, place) for place in line.T] for line, *of in zip(placed, held, along, strict=True)]
    )


@pytest.mark.parametrize("scale", [(1.0, 0.5, 3.0), (-1.0, 2.0, 1.0)])
def test_ties_stay_in_place_when_an_uneven_scale_is_applied(tied, scale):
    head = bpy.data.objects["Sphere"]
    head.animation_data_clear()
    head.scale = scale
    bpy.context.view_layer.update()
    before = tie_places(tied)
    select(head)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    update()
    np.testing.assert_allclose(tie_places(bpy.data.objects["Guides"]), before, atol=2e-3)


@pytest.mark.parametrize("scale", [0.01, 3.0])
def test_hair_is_held_up_to_its_tie_after_a_scale_is_applied(tied, scale):
    before, lengths = held_lengths(tied)
    head = bpy.data.objects["Sphere"]
    head.animation_data_clear()
    head.scale = (scale, scale, scale)
    bpy.context.view_layer.update()
    select(head)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    update()
    guides = bpy.data.objects["Guides"]
    now, longer = held_lengths(guides)
    np.testing.assert_allclose(longer, scale * lengths, rtol=1e-3)
    np.testing.assert_allclose(now, before, atol=1e-4)
