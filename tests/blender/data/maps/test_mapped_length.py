# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of *Strand Length* cuts each strand at the fraction of its length that the map gives at its root."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import sources
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import map_items
from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.maps.map_settings import MapSettings
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import drawn, window  # noqa: F401

SETTING = "strands.strand_length"


def points(hair):
    """Return (S, P, 3) float32, the points that hair Curves store."""
    return curves.read_points(hair).reshape(len(hair.curves), -1, 3)


def lengths(hair):
    return segment_lengths(points(hair).astype(np.float64)).sum(axis=1)


def vary(hair, **changes):
    map_items.keep(hair.vellus, MapSettings(setting=SETTING, **changes))
    bpy.context.view_layer.update()
    return points(hair)


def weights(hair):
    """Return (S,) weights of the vertex group "top" at the roots of strands."""
    settings = MapSettings(setting=SETTING, kind="GROUP", source="top")
    return sources.masks(sources.stored_strands(hair), settings, None)


def test_strands_have_the_fraction_of_their_length_that_the_map_gives(hair):
    """Each strand has its length without a map times a factor between From and To by its weight; roots and count
    stay.
    """
    before, uncut = lengths(hair.data), points(hair.data)
    cut = vary(hair.data, kind="GROUP", source="top", low=0.25, high=1.0)
    wanted = 0.25 + 0.75 * weights(hair.data).astype(float)
    assert wanted.min() < 0.3
    assert wanted.max() > 0.9
    np.testing.assert_allclose(lengths(hair.data) / before, wanted, rtol=2e-4)
    np.testing.assert_array_equal(cut[:, 0], uncut[:, 0])
    np.testing.assert_allclose(cut[wanted == 1.0], uncut[wanted == 1.0], atol=1e-7)
    assert api.clear_map(hair.data, SETTING)
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(points(hair.data), uncut)


def test_a_constant_map_is_the_value(hair):
    """A constant map of 0.5 gives bit for bit the points of the setting 0.5; the setting multiplies the map."""
    uncut, before = points(hair.data), lengths(hair.data)
    hair.data.vellus.hair.strand_length = 0.5
    bpy.context.view_layer.update()
    half = points(hair.data)
    np.testing.assert_allclose(lengths(hair.data), 0.5 * before, rtol=2e-4)
    hair.data.vellus.hair.strand_length = 1.0
    np.testing.assert_array_equal(vary(hair.data, kind="STRAND", low=0.5, high=0.5), half)
    np.testing.assert_array_equal(vary(hair.data, kind="STRAND", low=1.0, high=1.0), uncut)
    hair.data.vellus.hair.strand_length = 0.5
    bpy.context.view_layer.update()
    vary(hair.data, kind="STRAND", low=0.5, high=0.5)
    np.testing.assert_allclose(lengths(hair.data), 0.25 * before, rtol=2e-4)


def test_a_clump_is_cut_as_one(hair):
    """Strands of one clump have one random fraction; without clumps the length stays, with a status."""
    uncut = points(hair.data)
    np.testing.assert_array_equal(vary(hair.data, kind="CLUMP"), uncut)
    assert "clumps" in hair.data.vellus.status
    api.add_style(hair.data, "CLUMP", amount=0.0001, size=0.4, levels=1)
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == ""
    fractions = lengths(hair.data) / segment_lengths(uncut.astype(np.float64)).sum(axis=1)
    clumps = bindings.of(hair.data).styles.clumps[0]
    assert len(np.unique(clumps)) > 3
    for clump in np.unique(clumps):
        assert np.ptp(fractions[clumps == clump]) < 1e-3
    assert np.ptp(fractions) > 0.3


def test_a_missing_source_is_a_status(hair):
    """Hair with a map of the length whose source is missing keeps its length, and has a status with the name."""
    uncut = points(hair.data)
    cut = vary(hair.data, kind="GROUP", source="top")
    assert not np.array_equal(cut, uncut)
    np.testing.assert_array_equal(vary(hair.data, kind="GROUP", source="lost"), uncut)
    assert "lost" in hair.data.vellus.status
    np.testing.assert_array_equal(vary(hair.data, kind="GROUP", source="top"), cut)
    assert hair.data.vellus.status == ""


def test_painted_weights_cut_at_once(hair):
    """Changed weights of the group cut the strands in the next update; so does a renamed group that is picked again."""
    vary(hair.data, kind="GROUP", source="top")
    group = bpy.data.objects["Sphere"].vertex_groups["top"]
    group.add(range(len(bpy.data.objects["Sphere"].data.vertices)), 0.5, "REPLACE")
    bpy.data.objects["Sphere"].data.update_tag()
    bpy.context.view_layer.update()
    found = lengths(hair.data)
    api.clear_map(hair.data, SETTING)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(found, 0.5 * lengths(hair.data), rtol=2e-4)


def test_drawn_strands_are_cut_and_written_as_they_are_drawn(hair, window):  # noqa: F811
    """In a window, strands are drawn at the fractions of the map, and later written as drawn; without the map they are
    whole.
    """
    drawn(hair)
    for low in (0.5, 0.25):
        vary(hair.data, kind="GROUP", source="top", low=low)
        drawn(hair)
        shown = drawn_strands.places(hair_cache.strands_on_gpu(hair.data))
        bindings.of(hair.data).update_points()
        np.testing.assert_allclose(shown, bindings.of(hair.data).points, atol=5e-6)
    live_hair.write_all()
    cut = lengths(hair.data)
    np.testing.assert_array_equal(points(hair.data), bindings.of(hair.data).points)
    api.clear_map(hair.data, SETTING)
    bpy.context.view_layer.update()
    live_hair.write_all()
    np.testing.assert_allclose(cut / lengths(hair.data), 0.25 + 0.75 * weights(hair.data), rtol=2e-3)


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (-2.0, 1.0, 0.5)])
def test_transformed_surfaces_keep_the_fractions(hair, scale):
    """Small, mirrored and uneven surfaces cut strands at the same fraction."""
    bpy.data.objects["Sphere"].scale = scale
    bpy.data.objects["Sphere"].rotation_euler = (0.4, 0.1, 2.0)
    bpy.context.view_layer.update()
    hair.data.vellus.is_stale = True
    hair.data.update_tag()
    bpy.context.view_layer.update()
    world = np.array(bpy.data.objects["Sphere"].matrix_world)[:3, :3]

    def world_lengths():
        return segment_lengths(points(hair.data).astype(np.float64) @ world.T).sum(axis=1)

    before = world_lengths()
    vary(hair.data, kind="GROUP", source="top", low=0.25)
    np.testing.assert_allclose(world_lengths() / before, 0.25 + 0.75 * weights(hair.data), rtol=2e-3)
