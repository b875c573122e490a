# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of the look's *Wetness* wets each strand by its own amount."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.live import live_hair
from hair_addon.blender.materials import wet_nodes
from hair_addon.blender.render import hair_cache, offscreen
from hair_addon.blender.settings import map_items, shared_wetness
from hair_addon.blender.ui import map_rows
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from hair_addon.core.maps.map_settings import MapSettings
from tests.support import appended
from tests.support.interface.layout import Layout
from tests.support.pictures.gpu_strands import drawn, window  # noqa: F401

SETTING = "look.wetness"


def wetness(hair):
    """Return (S,) float32, the wetness that hair Curves store after an update; None without it."""
    bpy.context.view_layer.update()
    return curves.read_wetness(hair)


@pytest.fixture
def wet(hair):
    """Return hair Curves with a wet look."""
    hair.data.vellus.appearance.wetness = 0.8
    return hair.data


def picture():
    settings = PictureSettings(width=32, height=32, samples_per_side=1, is_transparent=True)
    return offscreen.draw_picture(settings).astype(np.float64)


def test_a_map_of_a_value_of_zero_says_so(wet):
    """The rows of a map say that it has no effect while the setting is 0."""
    item = map_items.keep(wet.vellus, MapSettings(setting=SETTING, kind="STRAND"))
    for value, says in ((0.8, False), (0.0, True)):
        wet.vellus.appearance.wetness = value
        layout = Layout()
        map_rows.draw(layout, item, wet)
        assert ("The setting is 0: its map has no effect" in layout.texts) == says


def test_a_map_multiplies_the_wetness_of_each_strand(wet):
    """Strands have the product of map and value, also where the value changes or is keyed; without the map they are
    even.
    """
    assert wetness(wet) is None
    api.set_map(wet, SETTING, "group:top", low=0.25)
    found = wetness(wet)
    assert (found.min(), found.max()) == (np.float32(0.2), np.float32(0.8))
    assert shared_wetness.of_hair(wet.vellus) == (0.0, 0.8)
    wet.vellus.appearance.wetness = 0.4
    np.testing.assert_allclose(wetness(wet), 0.5 * found, rtol=1e-6)
    for frame, value in ((1, 0.8), (3, 0.4)):
        wet.vellus.appearance.wetness = value
        wet.keyframe_insert("vellus.appearance.wetness", frame=frame)
    for frame, factor in ((1, 1.0), (3, 0.5)):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(wetness(wet), factor * found, rtol=1e-6)
    wet.animation_data_clear()
    api.set_map(wet, SETTING, "group:top", is_inverted=True)
    assert (wetness(wet) == 0.0).any()
    assert api.clear_map(wet, SETTING)
    assert wetness(wet) is None
    assert not any(map(wet_nodes.is_ours, wet.materials[0].node_tree.nodes))


def test_styles_and_maps_wet_the_same_strands(wet):
    """Each strand has the largest wetness of the map and of the Wet styles, masked or not."""
    api.set_map(wet, SETTING, "strand", seed=3)
    of_map = wetness(wet)
    assert len(np.unique(of_map)) > 0.9 * len(of_map)
    api.add_style(wet, "WET", amount=0.5)
    np.testing.assert_array_equal(wetness(wet), np.maximum(of_map, np.float32(0.5)))
    style = wet.vellus.styles[0].wet
    style.mask = "top"
    both = wetness(wet)
    assert (both >= of_map).all() and (both > of_map).any() and (both == of_map).any()


def test_undo_files_and_linked_hair_keep_the_wetness(wet, tmp_path):
    """Undo removes the map, redo restores it, and appended and linked hair has the wetness of its strands."""
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="even")
    api.set_map(wet, SETTING, "group:top", low=0.5)
    found = wetness(wet)
    bpy.ops.ed.undo_push(message="mapped")
    bpy.ops.ed.undo()
    assert wetness(bpy.data.hair_curves["Hair"]) is None
    bpy.ops.ed.redo()
    np.testing.assert_array_equal(wetness(bpy.data.hair_curves["Hair"]), found)
    path = str(tmp_path / "wet.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    for there in appended.in_new_files(path):
        np.testing.assert_array_equal(wetness(there), found)


def test_a_missing_source_is_a_status_and_the_value_is_used(wet):
    api.set_map(wet, SETTING, "group:lost")
    np.testing.assert_array_equal(wetness(wet), np.float32(0.8))
    assert "lost" in wet.vellus.status
    api.set_map(wet, SETTING, "group:top")
    assert wetness(wet).min() == 0.0
    assert wet.vellus.status == ""


@pytest.mark.long
def test_strands_are_drawn_as_wet_as_the_map(lit):
    """Maps of 0 and of 1 draw the dry and the wet hair, and a map between them draws neither."""
    state = lit.data.vellus
    state.model, state.hair.radius = "KAJIYA_KAY", 0.02  # which needs no tables
    pictures = {}
    for value in (0.0, 1.0):
        state.appearance.wetness = value
        bpy.context.view_layer.update()
        pictures[value] = picture()
    assert np.abs(pictures[0.0] - pictures[1.0]).max() > 0.02
    for factor, plain in pictures.items():
        api.set_map(lit.data, SETTING, "strand", low=factor, high=factor)
        bpy.context.view_layer.update()
        np.testing.assert_allclose(picture(), plain, atol=1.5 / 255.0)


def test_bound_hair_in_a_window_has_the_wetness_of_the_map(hair, window):  # noqa: F811
    """In a window, strands that are written later are shaded with the map at once."""
    hair.data.vellus.appearance.wetness = 1.0
    bpy.context.view_layer.update()
    drawn(hair)
    live_hair.write_all()
    for low in (0.5, 0.25):
        api.set_map(hair.data, SETTING, "group:top", low=low)
        bpy.context.view_layer.update()
        found = bindings.of(hair.data).wetness
        assert (found.min(), found.max()) == (low, 1.0)
        drawn(hair)
        np.testing.assert_array_equal(hair_cache.strands_on_gpu(hair.data).wetness_here, found)
    live_hair.write_all()
    np.testing.assert_array_equal(curves.read_wetness(hair.data), found)
