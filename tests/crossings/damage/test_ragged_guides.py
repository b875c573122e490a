# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of 2 to 200 points each are drawn, exported, edited and combed like guides of one count."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves, stored_roots
from hair_addon.blender.groom import bindings, pipeline
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.blender.ui import panels
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, use, world
from tests.support.interface.layout import draw_all
from tests.support.reading import write_points


@pytest.fixture
def ragged(sphere, rng):
    """Return 80 guides of 2 to 200 points, and hair between them."""
    made = curves_object(list(lines_on(sphere, rng, 80, 2, 200)))
    use(made, radius=0.004)
    return made


def ends(points, counts):
    """Return (G, 2, 3): the first and the last point of each curve."""
    last = np.cumsum(counts) - 1
    return np.stack([points[last - counts + 1], points[last]], axis=1)


def test_what_is_drawn_and_exported_is_where_the_surface_carries_it(ragged, sphere):
    twist = sphere.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()
    counts = curves.point_counts(ragged.data)
    wanted = ends(world(ragged), counts)
    assert np.abs(wanted - ends(stored(ragged), counts)).max() > 0.1
    for points in (hair_cache.strands_on_gpu(ragged.data).points, api.points(ragged)):
        assert points.shape == (80, counts.max(), 3)
        np.testing.assert_allclose(points[:, [0, -1]], wanted, atol=1e-5)
    hair = bpy.data.objects["Hair"]
    np.testing.assert_allclose(hair_cache.strands_on_gpu(hair.data).points.reshape(-1, 3), world(hair), atol=1e-5)


@pytest.mark.parametrize("kind", ["POLY", "CATMULL_ROM"])
def test_strands_follow_a_stroke_as_if_made_anew(ragged, sphere, monkeypatch, kind):
    monkeypatch.setattr(running, "has_window", lambda: True)
    ragged.data.set_types(type=kind)
    hair = bpy.data.objects["Hair"]
    counts = curves.point_counts(ragged.data)
    for _ in range(3):
        points = stored(ragged)
        bend = np.concatenate([np.linspace(0.0, 1.0, count) ** 2 for count in counts]).astype(np.float32)
        moved = np.repeat(np.arange(80) % 3 == 0, counts)
        points[moved, 0] += 0.1 * bend[moved]
        write_points(ragged, points)
    bound = bindings.of(hair.data)
    assert not bound.is_written and len(bound.radii) == bound.points.shape[1] == 41
    live_hair.write_all()
    wanted = pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get()).points
    np.testing.assert_array_equal(stored(hair).reshape(wanted.shape), wanted)
    live_hair.cancel_writing()
    invalidation.data_replaced()


def test_catmull_rom_guides_are_read_as_blender_draws_them(sphere):
    """Catmull-Rom guides are read as Blender draws them, also between their points: a half circle through seven
    points.
    """
    turn = np.linspace(0.0, np.pi, 7)
    arc = np.stack([np.cos(turn), 0.0 * turn, 1.0 + np.sin(turn)], axis=1)
    for kind, is_round in (("CATMULL_ROM", True), ("POLY", False)):
        made = curves_object([arc], kind, kind)
        use(made, grows_hair=False)
        surface = pipeline.scene.read_surface(sphere, bpy.context.evaluated_depsgraph_get())
        points = curves.read_guides(made.data, surface, "cpu").numpy()[0]
        error = abs(np.hypot(points[:, 0], points[:, 2] - 1.0) - 1.0).max()
        assert (error < 0.02) == is_round


def test_a_brush_that_adds_and_deletes_changes_the_hair(ragged, sphere, rng):
    before = stored(bpy.data.objects["Hair"])
    ragged.data.remove_curves(indices=[3, 40])
    ragged.data.add_curves([7])
    points = stored(ragged)
    points[-7:] = next(iter(lines_on(sphere, rng, 1, 7, 7)))
    write_points(ragged, points)
    assert not np.array_equal(stored(bpy.data.objects["Hair"]), before)
    stale = stored_roots.points(ragged.data, pipeline.scene.read_surface(sphere, bpy.context.evaluated_depsgraph_get()))
    np.testing.assert_allclose(stale.barycentric.sum(axis=1), 1.0, atol=1e-5)
    assert curves.is_hand_made(ragged.data)


def test_the_tab_offers_to_use_curves_and_says_what_they_are_then(sphere, rng):
    made = curves_object(list(lines_on(sphere, rng, 20)))
    select(made)
    drawn = draw_all(panels.CLASSES)
    assert drawn["vellus.use_as_guides"] == 1 and not drawn["vellus.distribute_guides"]
    use(made)
    drawn = draw_all(panels.CLASSES)
    assert not drawn["vellus.use_as_guides"] and not drawn["guide_count"] and drawn["vellus.comb_guides"] == 1
