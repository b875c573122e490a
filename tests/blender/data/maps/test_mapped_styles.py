# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps vary numbers of styles: each strand is as in hair whose style has the strand's value."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.groom.styles import style_notes
from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.styling import clump_trees
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import drawn, window  # noqa: F401

RADIUS = "styles.Curl.radius"


def points(curves_data):
    """Return (S, P, 3) float32, the points that hair Curves store after an update."""
    bpy.context.view_layer.update()
    return curves.read_points(curves_data).reshape(len(curves_data.curves), -1, 3)


def radius_set(curves_data, value):
    """Return the points with another radius of all curls, which is then set back."""
    group = curves_data.vellus.styles[0].curl
    before, group.radius = group.radius, value
    found = points(curves_data)
    group.radius = before
    return found


def half_group():
    """Return (a name of a vertex group with weight 1 in one half of the surface and 0 elsewhere, its object)."""
    surface = bpy.data.objects["Sphere"]
    group = surface.vertex_groups.new(name="half")
    group.add([v.index for v in surface.data.vertices if v.co.x > 0.05], 1.0, "REPLACE")
    return group.name, surface


def test_a_constant_map_is_the_value(curls):
    """A constant map of factor 1 keeps the bits, one of factor 0.5 gives those of half the radius; without the map the
    points return.
    """
    whole, half = points(curls), radius_set(curls, 0.025)
    assert not np.array_equal(whole, half)
    api.set_map(curls, RADIUS, "strand", low=1.0, high=1.0)
    np.testing.assert_array_equal(points(curls), whole)
    api.set_map(curls, RADIUS, "strand", low=0.5, high=0.5)
    np.testing.assert_array_equal(points(curls), half)
    assert api.clear_map(curls, RADIUS)
    np.testing.assert_array_equal(points(curls), whole)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (0.01, 0.01, 0.01), (-2.0, 1.0, 0.5)])
def test_each_half_has_the_curls_of_its_value(curls, scale):
    """Weights of 0 and 1 give strands with the bits of the radii at From and To, also on transformed surfaces."""
    name, surface = half_group()
    surface.scale, surface.rotation_euler = scale, (0.4, 0.1, 2.0)
    bpy.context.view_layer.update()
    curls.vellus.is_stale = True
    small, whole = radius_set(curls, 0.0125), radius_set(curls, 0.05)
    api.set_map(curls, RADIUS, f"group:{name}", low=0.25, high=1.0)
    found = points(curls)
    is_small, is_whole = ((found == other).all(axis=(1, 2)) for other in (small, whole))
    assert min(is_small.sum(), is_whole.sum()) > 0.3 * len(found)
    between = ~(is_small | is_whole)
    assert between.sum() < 0.2 * len(found)


def test_a_map_of_a_missing_style_is_a_status(curls):
    """A map or a curve of a style that the hair lacks, as from a settings file, is a status."""
    wanted = replace(api.settings_of(curls), maps=(MapSettings(setting="styles.Crul.radius", kind="STRAND"),))
    api.apply_settings(curls, wanted)
    plain = points(curls)
    assert 'no style "Crul"' in curls.vellus.status
    api.clear_map(curls, "styles.Crul.radius")
    np.testing.assert_array_equal(points(curls), plain)
    assert curls.vellus.status == ""


def test_maps_follow_their_style(curls):
    """A renamed style keeps its map, a copy of the style has the map too, and a removed style has none."""
    name, _surface = half_group()
    api.set_map(curls, RADIUS, f"group:{name}", low=0.25)
    varied = points(curls)
    curls.vellus.styles[0].name = "Ringlets"
    np.testing.assert_array_equal(points(curls), varied)
    assert [one.setting for one in api.maps_of(curls)] == ["styles.Ringlets.radius"]
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.ops.vellus.duplicate_style()
    settings = {one.setting for one in api.maps_of(curls)}
    assert settings == {"styles.Ringlets.radius", "styles.Ringlets.001.radius"}
    bpy.ops.vellus.move_style(direction="UP")
    assert {one.setting for one in api.maps_of(curls)} == settings
    bpy.ops.vellus.remove_style()
    assert [one.setting for one in api.maps_of(curls)] == ["styles.Ringlets.radius"]
    np.testing.assert_array_equal(points(curls), varied)


def test_a_settings_file_has_the_maps_of_styles(curls, tmp_path):
    """Settings with a map of a style are the same after a file, and give another hair the same maps."""
    name, _surface = half_group()
    api.set_map(curls, RADIUS, f"group:{name}", low=0.25)
    varied, settings = points(curls), groom_settings.settings_of(curls)
    settings_file.write(tmp_path / "curls.json", settings)
    loaded = settings_file.read(tmp_path / "curls.json")
    assert loaded.maps == settings.maps
    api.clear_map(curls, RADIUS)
    assert not np.array_equal(points(curls), varied)
    groom_settings.apply_settings(curls, loaded)
    np.testing.assert_array_equal(points(curls), varied)


def test_a_missing_source_is_a_status(curls):
    """A number with a missing source has its value, with a status that names the source."""
    whole = points(curls)
    api.set_map(curls, RADIUS, "group:lost")
    np.testing.assert_array_equal(points(curls), whole)
    assert "lost" in curls.vellus.status
    api.clear_map(curls, RADIUS)
    bpy.context.view_layer.update()
    assert curls.vellus.status == ""


@pytest.mark.parametrize("setting", ["styles.Curl.seed", "styles.Waves.radius", "styles.Curl.angle", "styles.radius"])
def test_wrong_names_are_errors(curls, setting):
    """A name without a style, or without a setting that maps can vary, is an error and adds no map."""
    with pytest.raises(HairError, match=r"No map can vary|has no style"):
        api.set_map(curls, setting, "strand")
    assert not api.maps_of(curls)


def test_drawn_strands_are_written_as_they_are_drawn(curls, window):  # noqa: F811
    """In a window, strands are drawn with the numbers of their maps, and later written as drawn."""
    name, _surface = half_group()
    hair = bpy.data.objects["Hair"]
    drawn(hair)
    for low in (0.5, 0.25):
        api.set_map(curls, RADIUS, f"group:{name}", low=low)
        bpy.context.view_layer.update()
        drawn(hair)
        shown = drawn_strands.places(hair_cache.strands_on_gpu(curls))
        bindings.of(curls).update_points()
        np.testing.assert_allclose(shown, bindings.of(curls).points, atol=2e-5)
    live_hair.write_all()
    np.testing.assert_array_equal(points(curls), bindings.of(curls).points)


def test_guides_lean_by_their_own_values(hair):
    """A map of a number of *Lean* gives the guides of each half the numbers of hair with this value everywhere."""
    name, _surface = half_group()
    api.add_style(hair.data, "LEAN", amount=0.6)
    api.set_map(hair.data, "styles.Lean.tip", "strand", low=1.0, high=1.0)
    whole = points(hair.data)
    api.clear_map(hair.data, "styles.Lean.tip")
    np.testing.assert_array_equal(points(hair.data), whole)
    hair.data.vellus.styles[0].lean.tip = 0.25
    weak = points(hair.data)
    hair.data.vellus.styles[0].lean.tip = 1.0
    api.set_map(hair.data, "styles.Lean.tip", f"group:{name}", low=0.25, high=1.0)
    found = points(hair.data)
    is_weak, is_whole = ((found == other).all(axis=(1, 2)) for other in (weak, whole))
    assert min(is_weak.sum(), is_whole.sum()) > 0.2 * len(found)
    assert not (is_weak & is_whole).any()


def test_sizes_of_locks_by_a_map(hair, window):  # noqa: F811
    """Each half has the locks of its size, and drawn strands equal written strands; a constant map equals the setting,
    and another map of the same sizes moves strands.
    """
    setting = "styles.Clump.size"
    api.add_style(hair.data, "CLUMP", size=0.5)
    name, surface = half_group()
    whole = points(hair.data)
    api.set_map(hair.data, setting, "strand", low=1.0, high=1.0)
    np.testing.assert_array_equal(points(hair.data), whole)
    api.set_map(hair.data, setting, "strand", low=0.5, high=0.5)
    half = points(hair.data)
    api.set_map(hair.data, setting, f"group:{name}", low=0.5, high=1.0)
    found = points(hair.data)
    is_half, is_whole = ((found == other).all(axis=(1, 2)) for other in (half, whole))
    assert min(is_half.sum(), is_whole.sum()) > 0.2 * len(found)
    drawn(hair)
    surface.vertex_groups[name].add([v.index for v in surface.data.vertices if v.co.z > 0.0], 1.0, "REPLACE")
    surface.data.update_tag()
    bpy.context.view_layer.update()
    drawn(hair)
    shown = drawn_strands.places(hair_cache.strands_on_gpu(hair.data))
    bindings.of(hair.data).update_points()
    np.testing.assert_allclose(shown, bindings.of(hair.data).points, atol=2e-5)
    assert np.abs(shown - found).max() > 0.01


def test_a_black_map_of_the_maximum_length_cuts(hair):
    """A map of *Maximum Length* shortens strands where it is black, although a maximum of zero is no limit; without a
    limit the map has no effect.
    """
    name, _surface = half_group()
    api.add_style(hair.data, "TRIM")
    setting, whole = "styles.Trim.to_length", points(hair.data)
    api.set_map(hair.data, setting, f"group:{name}")
    np.testing.assert_array_equal(points(hair.data), whole)
    hair.data.vellus.styles[0].trim.to_length = 10.0
    found = points(hair.data)
    lengths = np.linalg.norm(np.diff(found, axis=1), axis=2).sum(axis=1)
    is_black, is_white = (found[:, 0, 0] < side for side in (-0.15, 0.25))
    assert lengths[is_black].max() < 0.02 and not (found[is_black] == whole[is_black]).all(axis=(1, 2)).any()
    np.testing.assert_array_equal(found[~is_white], whole[~is_white])


@pytest.mark.parametrize(
    ("setting", "source"),
    [("styles.Lean.tip", "clump"), ("styles.Lean.tip", "curves:mine"), ("styles.Clump.size", "clump")],
)
def test_a_map_without_values_says_so(hair, setting, source):
    """A map by clumps or by an attribute of strands changes no numbers of guides and no sizes of locks, and the status
    says so; a random number for each strand or guide changes them.
    """
    api.add_style(hair.data, "CLUMP", size=0.5)
    api.add_style(hair.data, "LEAN", amount=0.6)
    hair.data.attributes.new("mine", "FLOAT", "CURVE")
    whole = points(hair.data)
    api.set_map(hair.data, setting, source, low=0.2, high=0.5)
    np.testing.assert_array_equal(points(hair.data), whole)
    assert f'cannot vary "{setting}": pick another kind of map.' in hair.data.vellus.status
    api.set_map(hair.data, setting, "strand", low=0.2, high=0.5)
    assert not np.array_equal(points(hair.data), whole) and hair.data.vellus.status == ""


def test_sizes_of_a_map_that_are_too_small_are_explained(hair, monkeypatch):
    """If only the smallest locks of a map are too small for the surface, a note on the style names the size in use."""
    monkeypatch.setattr(clump_trees, "MOST_SITES", 300)
    api.add_style(hair.data, "CLUMP", size=0.5, levels=1)
    name, _surface = half_group()
    points(hair.data)
    (item,) = hair.data.vellus.styles
    assert style_notes.notes_of(hair.data, item) == []
    api.set_map(hair.data, "styles.Clump.size", f"group:{name}", low=0.1, high=1.0)
    points(hair.data)
    size = (bindings.of(hair.data).styles.trees.area / (0.866 * 300)) ** 0.5
    assert 0.05 < size < 0.5
    text = f"The locks are too small for this surface: a size of {100.0 * size:.1f} cm is used."
    assert style_notes.notes_of(hair.data, item) == [text]
