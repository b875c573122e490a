# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps of maps change numbers by curves, and turn numbers into colors by color ramps."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import sources, strand_maps
from hair_addon.blender.data.strands import curves
from hair_addon.blender.settings import map_items, ramp_nodes
from hair_addon.command_line import map_options
from hair_addon.core.geometry.strands import lengths
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.shading import appearance
from tests.support import appended
from tests.support.reading import points

RED, BLUE = (0.5, 0.125, 0.0625), (0.0625, 0.125, 0.5)
BANDS = "constant 0:0.5/0.125/0.0625 0.5:0.0625/0.125/0.5"


def vary(hair, setting, **changes):
    map_items.keep(hair.vellus, MapSettings(setting=setting, **changes))
    bpy.context.view_layer.update()
    return map_items.item_of(hair.vellus, setting)


def ramp_of(hair, setting):
    return map_items.item_of(hair.data.vellus, setting).ramp_tree


@pytest.fixture
def coat(hair):
    """Return hair with a color."""
    hair.data.vellus.appearance.parametrization = "COLOR"
    bpy.context.view_layer.update()
    return hair


def absorption(color):
    return np.float32(appearance.sigma_a(appearance.Appearance(parametrization="COLOR", color=color)))


def masks_of(hair, **source):
    return sources.masks(sources.stored_strands(hair), MapSettings(**source), None)


def test_a_color_ramp_gives_each_strand_the_color_of_its_number(coat):
    """Strands have the color of the ramp at their random number, and Invert applies before the ramp."""
    masks = masks_of(coat.data, kind="STRAND", seed=3)
    for is_inverted in (False, True):
        vary(coat.data, "look.color", kind="STRAND", seed=3, ramp=BANDS, is_inverted=is_inverted)
        looks = strand_maps.read_looks(coat.data)
        values = 1.0 - masks if is_inverted else masks
        is_clear = np.abs(values - 0.5) > 0.01  # the ramp is sampled
        wanted = np.where((values > 0.5)[:, None], absorption(BLUE), absorption(RED))
        np.testing.assert_array_equal(looks.root[is_clear], wanted[is_clear])
        assert 0.2 < (values > 0.5).mean() < 0.8


def test_alpha_is_the_share_of_the_ramps_color(coat):
    """A ramp of one color with an alpha of one quarter mixes a quarter of it with the setting's color."""
    coat.data.vellus.appearance.color = RED
    vary(coat.data, "look.color", kind="STRAND", ramp="0:0.0625/0.125/0.5/0.25")
    looks = strand_maps.read_looks(coat.data)
    mixed = tuple(0.75 * np.array(RED) + 0.25 * np.array(BLUE))
    np.testing.assert_allclose(looks.root, np.tile(absorption(mixed), (len(looks), 1)), rtol=1e-5)


def test_a_curve_changes_the_numbers_of_a_map(hair):
    """A line from 0 to 1 changes nothing, and a step makes two kinds of strands, in thickness, length and pigment."""
    for setting in ("strands.thickness", "strands.strand_length", "look.melanin"):
        vary(hair.data, setting, kind="STRAND", low=0.5)
    radii, long = curves.read_radii(hair.data).copy(), lengths(points(hair))
    pigment = strand_maps.read_looks(hair.data).root[:, 0]
    for setting in ("strands.thickness", "strands.strand_length", "look.melanin"):
        vary(hair.data, setting, kind="STRAND", low=0.5, ramp="0:0 1:1")
    np.testing.assert_allclose(curves.read_radii(hair.data), radii, rtol=1e-5)
    np.testing.assert_allclose(lengths(points(hair)), long, rtol=1e-4)
    np.testing.assert_allclose(strand_maps.read_looks(hair.data).root[:, 0], pigment, rtol=1e-5)
    for setting in ("strands.thickness", "strands.strand_length", "look.melanin"):
        vary(hair.data, setting, kind="STRAND", low=0.5, ramp="0:0 0.499:0 0.501:1 1:1")
    is_high = masks_of(hair.data, kind="STRAND") > 0.51
    found = curves.read_radii(hair.data).reshape(len(hair.data.curves), -1)[:, 0]
    assert len(np.unique(found[is_high])) == 1
    np.testing.assert_allclose(found.min() / found.max(), 0.5, rtol=1e-5)
    dark = strand_maps.read_looks(hair.data).root[:, 0]
    assert len(np.unique(dark[is_high])) == 1
    shares = lengths(points(hair))[is_high] / long[is_high]
    assert shares.min() >= 0.99 and shares.max() > 1.1


def test_an_edit_in_the_widget_updates_hair_and_copies_have_their_own(coat):
    """A moved stop changes the strands of its hair, but not those of a copy, and undo restores the strands."""
    bpy.context.view_layer.objects.active = coat
    vary(coat.data, "look.color", kind="STRAND", ramp=BANDS)
    copy = coat.copy()
    copy.data = coat.data.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="bands")
    before = strand_maps.read_looks(coat.data)
    assert ramp_of(coat, "look.color") != ramp_of(copy, "look.color")
    tree = ramp_of(coat, "look.color")
    ramp_nodes.node_of(tree).color_ramp.elements[0].color = (*BLUE, 1.0)
    tree.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(
        strand_maps.read_looks(coat.data).root, np.tile(absorption(BLUE), (len(coat.data.curves), 1))
    )
    assert strand_maps.read_looks(copy.data).is_same(before)
    bpy.ops.ed.undo_push(message="edited")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(bpy.data.objects["Hair"].data).is_same(before)


def test_files_and_settings_keep_ramps(coat, tmp_path):
    """Appended and linked hair, a settings file, `api` and the command line have the ramps of maps and thickness."""
    wanted = api.set_map(coat.data, "look.color", "strand", ramp=BANDS)
    assert map_options.parsed_map(f"look.color=strand,ramp={BANDS}") == wanted
    api.set_thickness_curve(coat, "0:1 0.5:0.25:auto 1:0.5")
    bpy.context.view_layer.update()
    looks, radii = strand_maps.read_looks(coat.data), curves.read_radii(coat.data).copy()
    assert len(np.unique(radii)) > 10
    api.save_settings(tmp_path / "coat.json", api.settings_of(coat))
    path = str(tmp_path / "coat.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    count = len(bpy.data.node_groups)
    assert api.clear_map(coat, "look.color")
    api.set_thickness_curve(coat)
    assert len(bpy.data.node_groups) == count - 2
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat.data) is None
    api.apply_settings(coat, api.load_settings(tmp_path / "coat.json"))
    bpy.context.view_layer.update()
    assert api.maps_of(coat) == (wanted,) and api.thickness_curve_of(coat) == "0:1 0.5:0.25:auto 1:0.5"
    assert strand_maps.read_looks(coat.data).is_same(looks)
    np.testing.assert_array_equal(curves.read_radii(coat.data), radii)
    for found in appended.in_new_files(path):
        assert map_items.maps_of(found.vellus) == (wanted,)
        assert strand_maps.read_looks(found).is_same(looks)


def test_the_panels_buttons_add_and_remove_a_ramp(coat):
    """A new color ramp ends in the setting's color, a new curve is a line, and removing a ramp leaves no node group."""
    bpy.context.view_layer.objects.active = coat
    before = len(bpy.data.node_groups)
    coat.data.vellus.appearance.color = RED
    vary(coat.data, "look.color", kind="STRAND")
    vary(coat.data, "look.roughness", kind="STRAND")
    plain = strand_maps.read_looks(coat.data)
    for setting, text in (("look.color", "0:0/0/0 1:0.5/0.125/0.0625"), ("look.roughness", "0:0 1:1")):
        assert bpy.ops.vellus.add_map_ramp(setting=setting) == {"FINISHED"}
        assert map_items.settings_of(map_items.item_of(coat.data.vellus, setting)).ramp == text
    bpy.context.view_layer.update()
    assert not strand_maps.read_looks(coat.data).is_same(plain)
    for setting in ("look.color", "look.roughness"):
        assert bpy.ops.vellus.remove_map_ramp(setting=setting) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert strand_maps.read_looks(coat.data).is_same(plain)
    assert len(bpy.data.node_groups) == before
