# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps and the thickness curve change the radii of kept hair."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.data.maps import sources, strand_maps
from hair_addon.blender.data.strands import curves, kept_widths
from hair_addon.blender.groom import pipeline
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import ramp_nodes
from hair_addon.core.geometry.affine import Affine
from hair_addon.core.maps.map_settings import MapSettings
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored

COUNT = 60


@pytest.fixture
def kept(sphere, rng):
    """Return polylines of 5 to 12 points with radii and a number of their own, used as hair."""
    hair = curves_object(list(lines_on(sphere, rng, COUNT, least=5)))
    radii = hair.data.attributes.get("radius") or hair.data.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", rng.uniform(0.001, 0.003, len(hair.data.points)).astype(np.float32))
    tone = hair.data.attributes.new("tone", "FLOAT", "CURVE")
    tone.data.foreach_set("value", rng.random(COUNT).astype(np.float32))
    select(sphere, hair)
    assert bpy.ops.vellus.use_as_hair(guide_count=8) == {"FINISHED"}
    update()
    return hair


def masks(hair, kind, source=""):
    return sources.masks(sources.stored_strands(hair.data), MapSettings(kind=kind, source=source), None)


def of_points(hair, values):
    return np.repeat(values, np.diff(curves.curve_offsets(hair.data)))


@pytest.mark.parametrize(("source", "kind", "name"), [("group:top", "GROUP", "top"), ("curves:tone", "CURVES", "tone")])
def test_a_map_multiplies_the_radii_that_hair_came_with(kept, source, kind, name):
    """Each strand has its original radii times the factor at its root or by its attribute; removing the map restores
    them.
    """
    before, points = curves.read_radii(kept.data).copy(), stored(kept).copy()
    for high in (2.0, 3.0):
        api.set_map(kept, "strands.thickness", source, low=0.5, high=high)
        update()
        factors = 0.5 + (high - 0.5) * masks(kept, kind, name)
        assert factors.max() > 1.5 * factors.min()
        np.testing.assert_allclose(curves.read_radii(kept.data), before * of_points(kept, factors), rtol=1e-6)
        assert kept.data.vellus.status == "" and not kept.data.vellus.is_stale
    api.clear_map(kept, "strands.thickness")
    update()
    np.testing.assert_array_equal(curves.read_radii(kept.data), before)
    assert not kept_widths.are_kept(kept.data)
    np.testing.assert_array_equal(stored(kept), points)


def test_the_curve_gives_parts_of_the_radius_at_the_root(kept):
    """Radii follow the curve and its edits, and removing the curve restores the original radii."""
    before, starts = curves.read_radii(kept.data).copy(), curves.curve_offsets(kept.data)
    at_roots = of_points(kept, before[starts[:-1]])
    api.set_thickness_curve(kept, "0:1 1:0.25")
    update()
    found = curves.read_radii(kept.data) / at_roots
    np.testing.assert_allclose(found[starts[:-1]], 1.0)
    np.testing.assert_allclose(found[starts[1:] - 1], 0.25, rtol=1e-5)
    drawn = hair_cache.strands_on_gpu(kept.data).radii
    tree = kept.data.vellus.thickness_ramp
    ramp_nodes.node_of(tree).mapping.curves[0].points[1].location = (1.0, 0.75)
    ramp_nodes.node_of(tree).mapping.update()
    tree.update_tag()
    update()
    np.testing.assert_allclose((curves.read_radii(kept.data) / at_roots)[starts[1:] - 1], 0.75, rtol=1e-5)
    assert not np.array_equal(hair_cache.strands_on_gpu(kept.data).radii, drawn)
    api.set_thickness_curve(kept)
    update()
    np.testing.assert_array_equal(curves.read_radii(kept.data), before)


def test_a_missing_source_is_a_status_and_a_look_needs_none(kept):
    """A map without its source leaves the radii unchanged and names the source; maps of the look need no radii."""
    before = curves.read_radii(kept.data).copy()
    api.set_map(kept, "strands.thickness", "group:lost")
    update()
    assert "lost" in kept.data.vellus.status
    np.testing.assert_array_equal(curves.read_radii(kept.data), before)
    api.set_map(kept, "look.melanin", "curves:tone")
    update()
    assert len(np.unique(strand_maps.read_looks(kept.data).root[:, 0])) == COUNT


def test_other_sizes_and_other_strands_do_not_bring_old_radii_back(kept):
    """Widened hair has widened radii without its map; regenerated strands have no radii of their own to return to."""
    before = curves.read_radii(kept.data).copy()
    api.set_map(kept, "strands.thickness", "strand")
    update()
    curves.widen(kept.data, Affine(np.diag([2.0, 2.0, 2.0, 1.0])))
    api.clear_map(kept, "strands.thickness")
    update()
    np.testing.assert_allclose(curves.read_radii(kept.data), 2.0 * before, rtol=1e-6)
    api.set_map(kept, "strands.thickness", "strand")
    update()
    pipeline.interpolate_hair(*pipeline.inputs_of(kept.data), scene.present_depsgraph(), kept.data)
    assert not kept_widths.are_kept(kept.data)


def test_undo_takes_a_map_back(kept):
    """Undo restores the radii and removes the map, and the next map starts from the original radii."""
    before = curves.read_radii(kept.data).copy()
    bpy.ops.ed.undo_push(message="kept")
    api.set_map(kept, "strands.thickness", "strand", low=0.5, high=0.5)
    update()
    bpy.ops.ed.undo_push(message="mapped")
    bpy.ops.ed.undo()
    update()
    hair = next(datablock for datablock in bpy.data.hair_curves if datablock.vellus.kind == "HAIR")
    np.testing.assert_array_equal(curves.read_radii(hair), before)
    bpy.ops.ed.redo()
    update()
    hair = next(datablock for datablock in bpy.data.hair_curves if datablock.vellus.kind == "HAIR")
    np.testing.assert_array_equal(curves.read_radii(hair), np.float32(0.5) * before)


def test_kept_hair_has_the_wetness_of_its_map(kept):
    """Each strand has the wetness of the look times the factor at its root, beside a map of its thickness."""
    kept.data.vellus.appearance.wetness = 0.5
    api.set_map(kept, "strands.thickness", "curves:lost")
    api.set_map(kept, "look.wetness", "curves:tone")
    update()
    np.testing.assert_allclose(curves.read_wetness(kept.data), 0.5 * masks(kept, "CURVES", "tone"), rtol=1e-6)
    assert "lost" in kept.data.vellus.status and not kept.data.vellus.is_stale
    api.clear_map(kept, "strands.thickness")
    kept.data.vellus.appearance.wetness = 1.0
    update()
    np.testing.assert_allclose(curves.read_wetness(kept.data), masks(kept, "CURVES", "tone"), rtol=1e-6)
    assert kept.data.vellus.status == ""
