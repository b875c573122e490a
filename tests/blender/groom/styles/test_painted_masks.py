# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair follows while the mask of a style is painted, and masks are created from selected guides."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.blender.settings import style_items
from hair_addon.core.styling import curl, trim
from tests.support.reading import points, vertex_positions


@pytest.fixture
def styled(hair):
    """Return hair on the sphere with an active Trim to a fifth of its length."""
    style_items.add(hair.data.vellus, trim.Settings(factor=0.2), "Trim")
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="trim")
    return hair


def sphere():
    return bpy.data.objects["Sphere"]


def hair_object():
    return bpy.data.objects["Hair"]


def lengths():
    return np.linalg.norm(np.diff(points(hair_object()), axis=1), axis=2).sum(axis=1)


def weigh(name, chosen, weight=1.0):
    """Set the weights of vertices that chosen(positions) marks, as a stroke does."""
    group = sphere().vertex_groups[name]
    group.add([int(i) for i in np.flatnonzero(chosen(vertex_positions(sphere())))], weight, "REPLACE")
    sphere().data.update()
    bpy.context.view_layer.update()


def right(places):
    return places[..., 0] > 0.0


def active_group():
    state = hair_object().data.vellus
    return style_items.group_of(style_items.active_of(state))


def unstyled():
    """Return the lengths (S,) without the style."""
    active_group().is_on = False
    bpy.context.view_layer.update()
    found = lengths()
    active_group().is_on = True
    bpy.context.view_layer.update()
    return found


def test_painting_makes_a_group_that_hair_follows(styled):
    full, cut = unstyled(), lengths()
    np.testing.assert_allclose(cut, 0.2 * full, rtol=1e-2)
    assert bpy.ops.vellus.paint_style_mask() == {"FINISHED"}
    assert sphere().mode == "WEIGHT_PAINT" and bpy.context.object == sphere()
    name = active_group().mask
    assert sphere().vertex_groups.active.name == name == "Trim Mask"
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(lengths(), full)  # nothing is painted yet
    binding = bindings.of(styled.data).binding
    weigh(name, right)
    roots = points(styled)[:, 0]
    inside, outside = roots[:, 0] > 0.2, roots[:, 0] < -0.2
    np.testing.assert_allclose(lengths()[inside], cut[inside], rtol=1e-5)
    np.testing.assert_array_equal(lengths()[outside], full[outside])
    weigh(name, right, 0.5)
    between = lengths()[inside]
    assert (between > cut[inside]).all() and (between < full[inside]).all()
    assert bindings.of(styled.data).binding is binding  # nothing was searched
    assert bpy.ops.vellus.paint_style_mask() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert sphere().mode == "OBJECT" and bpy.context.object == styled
    np.testing.assert_array_equal(lengths()[inside], between)


def test_settings_of_styles_are_followed_in_the_paint_mode(styled):
    bpy.ops.vellus.paint_style_mask()
    weigh("Trim Mask", right)
    inside = points(styled)[:, 0, 0] > 0.2
    before = lengths()[inside]
    active_group().factor = 0.4
    bpy.context.view_layer.update()
    np.testing.assert_allclose(lengths()[inside], 2.0 * before, rtol=2e-2)


def test_roots_wait_where_the_guides_are_on_another_surface(styled):
    """While the guides' surface is painted, styles follow and roots wait until the mode is left, as on one surface."""
    other = bpy.data.objects.new("Other", sphere().data.copy())
    bpy.context.collection.objects.link(other)
    styled.data.surface = other
    bpy.context.view_layer.update()
    cut, count = lengths(), len(styled.data.curves)
    bpy.ops.vellus.paint_style_mask()
    active_group().mask = ""
    bpy.context.view_layer.update()
    active_group().factor = 0.4
    bpy.context.view_layer.update()
    np.testing.assert_allclose(lengths(), 2.0 * cut, rtol=2e-2)
    styled.data.vellus.hair.strand_count = count // 2
    bpy.context.view_layer.update()
    assert len(styled.data.curves) == count
    bpy.ops.vellus.paint_style_mask()
    bpy.context.view_layer.update()
    assert len(styled.data.curves) == count // 2


def test_masks_are_painted_on_the_surface_of_the_guides(styled):
    """Hair without a surface of its own is painted on the surface of its guides."""
    styled.data.surface = None
    for paint in (bpy.ops.vellus.paint_style_mask, bpy.ops.vellus.paint_density):
        assert paint() == {"FINISHED"} and sphere().mode == "WEIGHT_PAINT"
        assert paint() == {"FINISHED"} and sphere().mode == "OBJECT"


def test_a_group_that_is_there_is_painted_and_a_lost_one_is_made(styled):
    active_group().mask = "top"
    bpy.context.view_layer.update()
    count = len(sphere().vertex_groups)
    bpy.ops.vellus.paint_style_mask()
    assert len(sphere().vertex_groups) == count and sphere().vertex_groups.active.name == "top"
    bpy.ops.vellus.paint_style_mask()
    active_group().mask = "Lost"
    bpy.ops.vellus.paint_style_mask()
    assert sphere().vertex_groups.active.name == "Lost" == active_group().mask


def test_each_style_has_a_group_of_its_own(styled):
    bpy.ops.vellus.paint_style_mask()
    bpy.ops.vellus.paint_style_mask()
    style_items.duplicate(styled.data.vellus, 0)
    active_group().mask = ""
    sphere().data.attributes.new("Trim.001 Mask", "FLOAT", "POINT")
    bpy.ops.vellus.paint_style_mask()
    masks = [style_items.group_of(item).mask for item in styled.data.vellus.styles]
    assert masks == ["Trim Mask", "Trim.001 Mask.001"]


@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_a_color_attribute_is_painted_in_vertex_paint(styled, kind, domain):
    full, cut = unstyled(), lengths()
    attribute = sphere().data.color_attributes.new("Shade", kind, domain)
    values = np.zeros((len(attribute.data), 4), np.float32)
    attribute.data.foreach_set("color", values.ravel())
    active_group().mask = "Shade"
    bpy.context.view_layer.update()
    assert bpy.ops.vellus.paint_style_mask() == {"FINISHED"}
    assert sphere().mode == "VERTEX_PAINT" and sphere().data.color_attributes.active_color.name == "Shade"
    np.testing.assert_array_equal(lengths(), full)
    values[:] = 1.0
    sphere().data.color_attributes["Shade"].data.foreach_set("color", values.ravel())
    sphere().data.update()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(lengths(), cut, rtol=1e-5)


def test_an_image_is_painted_in_texture_paint(styled):
    full, cut = unstyled(), lengths()
    image = bpy.data.images.new("Short", 16, 16)
    image.pixels.foreach_set(np.zeros(16 * 16 * 4, np.float32))
    active_group().mask_image = "Short"
    bpy.context.view_layer.update()
    assert styled.data.vellus.status == ""
    np.testing.assert_array_equal(lengths(), full)
    assert bpy.ops.vellus.paint_style_mask() == {"FINISHED"}
    assert sphere().mode == "TEXTURE_PAINT" and bpy.context.tool_settings.image_paint.canvas == image
    image.pixels.foreach_set(np.ones(16 * 16 * 4, np.float32))
    image.update_tag()
    bpy.context.view_layer.update()
    if not np.allclose(lengths(), cut, rtol=1e-5):  # Blender may report it only when the mode is left
        bpy.ops.vellus.paint_style_mask()
        bpy.context.view_layer.update()
    np.testing.assert_allclose(lengths(), cut, rtol=1e-5)


def test_other_attributes_are_not_painted_over(styled):
    sphere().data.attributes.new("Number", "FLOAT", "POINT")
    active_group().mask = "Number"
    with pytest.raises(RuntimeError, match="not a vertex group or color attribute"):
        bpy.ops.vellus.paint_style_mask()
    assert sphere().mode == "OBJECT" and "Number" not in sphere().vertex_groups


def test_hair_follows_in_a_file_that_was_just_opened(styled, tmp_path):
    bpy.ops.vellus.paint_style_mask()
    bpy.ops.vellus.paint_style_mask()
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hair.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "hair.blend"))
    bpy.context.view_layer.update()
    assert bindings.of(hair_object().data) is None
    full = lengths()
    bpy.ops.vellus.paint_style_mask()
    weigh("Trim Mask", right)
    inside = points(hair_object())[:, 0, 0] > 0.2
    np.testing.assert_allclose(lengths()[inside], 0.2 * full[inside], rtol=1e-2)
    outside = points(hair_object())[:, 0, 0] < -0.2
    np.testing.assert_array_equal(lengths()[outside], full[outside])


def test_a_mesh_that_changes_in_the_paint_mode_is_said_and_followed_afterwards(styled):
    bpy.ops.vellus.paint_style_mask()
    weigh("Trim Mask", right)
    sphere().modifiers.new("Twice", "ARRAY")
    weigh("Trim Mask", right, 0.5)
    assert "has changed" in styled.data.vellus.status
    bpy.ops.vellus.paint_style_mask()
    bpy.context.view_layer.update()
    assert styled.data.vellus.status == ""
    assert len(bindings.of(styled.data).surface.rest) > 642


def test_a_mask_is_painted_on_a_surface_that_is_subdivided_in_the_paint_mode(styled):
    bpy.ops.vellus.paint_style_mask()
    weigh("Trim Mask", right)
    sphere().modifiers.new("Subdivision", "SUBSURF")
    weigh("Trim Mask", right, 0.5)
    assert styled.data.vellus.status == ""
    bpy.ops.vellus.paint_style_mask()
    bpy.context.view_layer.update()
    assert styled.data.vellus.status == ""


def test_painting_and_its_group_are_undone(styled):
    bpy.ops.vellus.paint_style_mask("EXEC_DEFAULT", True)
    assert sphere().mode == "WEIGHT_PAINT"
    bpy.ops.ed.undo()
    assert sphere().mode == "OBJECT" and "Trim Mask" not in sphere().vertex_groups and active_group().mask == ""
    bpy.ops.ed.redo()
    assert "Trim Mask" in sphere().vertex_groups and active_group().mask == "Trim Mask"


def select(guides, values, domain="CURVE", kind="FLOAT"):
    attribute = guides.attributes.new(".selection", kind, domain)
    attribute.data.foreach_set("value", values)


@pytest.mark.parametrize("kind", ["FLOAT", "BOOLEAN"])
@pytest.mark.parametrize("domain", ["CURVE", "POINT"])
def test_selected_guides_become_a_mask(styled, kind, domain):
    full, cut = unstyled(), lengths()
    guides = bpy.data.objects["Guides"].data
    places = points(bpy.data.objects["Guides"])
    chosen = places[:, 0, 0] > 0.0
    values = chosen.astype(np.float32) if kind == "FLOAT" else chosen
    if domain == "POINT":  # the tips alone
        values = np.zeros(places.shape[:2], values.dtype)
        values[chosen, -1] = 1
    select(guides, values.ravel(), domain, kind)
    assert bpy.ops.vellus.mask_from_selection() == {"FINISHED"}
    bpy.context.view_layer.update()
    name = active_group().mask
    stored = np.empty(len(chosen), np.float32)
    guides.attributes[name].data.foreach_get("value", stored)
    np.testing.assert_array_equal(stored, chosen)
    roots = points(styled)[:, 0]
    far = np.abs(roots[:, 0]) > 0.8
    np.testing.assert_allclose(lengths()[far & right(roots)], cut[far & right(roots)], rtol=5e-3)
    np.testing.assert_allclose(lengths()[far & ~right(roots)], full[far & ~right(roots)], rtol=5e-3)


def test_a_mask_from_a_selection_is_replaced_by_the_next(styled):
    guides = bpy.data.objects["Guides"].data
    count = len(guides.curves)
    select(guides, np.arange(count) < count // 2)
    bpy.ops.vellus.mask_from_selection()
    bpy.context.view_layer.update()
    first, name = lengths(), active_group().mask
    guides.attributes[".selection"].data.foreach_set("value", np.arange(count) >= count // 2)
    bpy.ops.vellus.mask_from_selection()
    bpy.context.view_layer.update()
    assert active_group().mask == name
    assert not np.allclose(lengths(), first)


def test_without_a_selection_the_reason_is_shown(styled):
    with pytest.raises(RuntimeError, match="Select guides"):
        bpy.ops.vellus.mask_from_selection()
    guides = bpy.data.objects["Guides"].data
    select(guides, np.zeros(len(guides.curves), np.float32))
    with pytest.raises(RuntimeError, match="Select guides"):
        bpy.ops.vellus.mask_from_selection()
    assert active_group().mask == ""


def test_a_mask_from_a_selection_is_undone(styled):
    guides = bpy.data.objects["Guides"].data
    select(guides, np.arange(len(guides.curves)) < 9)
    bpy.ops.ed.undo_push(message="selection")
    before = points(styled)
    bpy.ops.vellus.mask_from_selection("EXEC_DEFAULT", True)
    bpy.context.view_layer.update()
    assert not np.array_equal(points(hair_object()), before)
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert active_group().mask == "" and "Trim Mask" not in bpy.data.objects["Guides"].data.attributes
    np.testing.assert_array_equal(points(hair_object()), before)


def test_masks_need_hair_with_styles(hair):
    for operator in (bpy.ops.vellus.paint_style_mask, bpy.ops.vellus.mask_from_selection):
        assert not operator.poll()
    style_items.add(hair.data.vellus, curl.Settings())
    assert bpy.ops.vellus.paint_style_mask.poll() and bpy.ops.vellus.mask_from_selection.poll()


def test_in_a_window_hair_is_drawn_first_and_written_afterwards(styled, monkeypatch):
    monkeypatch.setattr(running, "has_window", lambda: True)
    bpy.ops.vellus.paint_style_mask()
    weigh("Trim Mask", right)
    live_hair.write_all()
    before = points(styled)
    weigh("Trim Mask", right, 0.5)
    bound = bindings.of(styled.data)
    assert not bound.is_written and not np.array_equal(bound.points, before)
    np.testing.assert_array_equal(points(styled), before)
    live_hair.write_all()
    np.testing.assert_array_equal(points(styled), bound.points)
    assert not styled.data.vellus.is_stale
