# SPDX-License-Identifier: GPL-3.0-or-later
"""With several hair systems on a surface in a paint mode, panels and operators use the one whose mask is painted."""

import bpy
import pytest

from hair_addon.blender.groom import selection
from hair_addon.blender.settings import style_items
from hair_addon.core.styling import curl, frizz, trim
from tests.support.interface.layout import draw


@pytest.fixture
def two(hair):
    """Return an older hair with Trim and Frizz and a newer hair with Curl; the older hair is active."""
    sphere = hair.data.surface
    style_items.add(hair.data.vellus, trim.Settings(factor=0.5), "Trim")
    style_items.add(hair.data.vellus, frizz.Settings(), "Frizz")
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.vellus.distribute_guides(guide_count=20, length=0.2)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides.001"]
    bpy.ops.vellus.interpolate_hair(strand_count=50)
    newer = bpy.data.objects["Hair.001"]
    style_items.add(newer.data.vellus, curl.Settings(), "Curl")
    for found in (hair, newer):  # more systems than those that are painted
        found.data.vellus.hair.density_group = ""
    bpy.context.view_layer.update()
    selection.make_active(hair, bpy.context.view_layer)
    return hair, newer


def sphere():
    return bpy.data.objects["Sphere"]


def shown():
    """Return the hair that panels show, by each of the functions that panels call."""
    found = selection.hair_of(bpy.context.object)
    systems = bpy.data.hair_curves[bpy.context.view_layer.vellus_system]
    assert systems == found
    return found


def test_the_panel_stays_with_the_hair_whose_mask_is_painted(two):
    older, newer = two
    older.data.vellus.active_style = 0
    assert bpy.ops.vellus.paint_style_mask() == {"FINISHED"}
    assert bpy.context.object == sphere() and shown() == older.data
    assert "Stop Painting" in " ".join(draw(bpy.types.VELLUS_PT_styles_mask).texts)
    assert bpy.ops.vellus.remove_style() == {"FINISHED"}
    assert style_items.names_of(older.data.vellus) == ("Frizz",)
    assert style_items.names_of(newer.data.vellus) == ("Curl",)


def test_another_group_shows_the_hair_that_it_masks(two):
    older, newer = two
    bpy.ops.vellus.paint_style_mask()
    groups = sphere().vertex_groups
    newer.data.vellus.styles["Curl"].curl.mask = groups.new(name="Ends").name
    groups.active = groups["Ends"]
    assert shown() == newer.data
    groups.active = groups["Frizz Mask"]
    assert shown() == older.data
    groups.active = groups["top"]
    assert shown() == newer.data  # the newest, as nothing is masked by it
    older.data.vellus.guide_curves.vellus.guides.density_group = "top"
    assert shown() == older.data


def test_a_group_of_two_hairs_shows_that_whose_active_style_it_masks(two):
    older, newer = two
    older.data.vellus.styles["Trim"].trim.mask = newer.data.vellus.styles["Curl"].curl.mask = "top"
    older.data.vellus.active_style = 0
    bpy.ops.vellus.paint_style_mask()
    newer.data.vellus.active_style = 1  # of one style: none
    assert shown() == older.data
    older.data.vellus.active_style, newer.data.vellus.active_style = 1, 0
    assert shown() == newer.data


def test_colors_and_images_are_masks_too(two):
    older, _newer = two
    sphere().data.color_attributes.new("Shade", "FLOAT_COLOR", "POINT")
    older.data.vellus.styles["Trim"].trim.mask = "Shade"
    older.data.vellus.active_style = 0
    bpy.ops.vellus.paint_style_mask()
    assert sphere().mode == "VERTEX_PAINT" and shown() == older.data
    bpy.ops.vellus.paint_style_mask()
    assert bpy.context.object == older
    older.data.vellus.styles["Trim"].trim.mask = ""
    older.data.vellus.styles["Trim"].trim.mask_image = bpy.data.images.new("Short", 8, 8).name
    bpy.ops.vellus.paint_style_mask()
    assert sphere().mode == "TEXTURE_PAINT" and shown() == older.data
    bpy.ops.vellus.paint_style_mask()
    assert bpy.context.object == older


def test_outside_of_paint_modes_the_newest_is_shown(two):
    bpy.ops.vellus.paint_style_mask()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.context.object == sphere() and shown() == two[1].data


def test_painting_ends_with_the_hair_that_was_painted(two):
    bpy.ops.vellus.paint_style_mask()
    bpy.ops.vellus.paint_style_mask()
    assert bpy.context.object == two[0] and shown() == two[0].data
