# SPDX-License-Identifier: GPL-3.0-or-later
"""*Comb Guides* shows hidden guides first; if that is impossible, a message says why."""

import bpy
import pytest


def collection_of_guides(guides, parent=None):
    """Return the layer collection of a new collection that holds the guides alone."""
    parent = parent or bpy.context.scene.collection
    collection = bpy.data.collections.new("Hidden")
    parent.children.link(collection)
    for other in guides.users_collection:
        other.objects.unlink(guides)
    collection.objects.link(guides)
    found = bpy.context.view_layer.layer_collection
    while "Hidden" not in found.children:
        found = found.children[0]
    return found.children["Hidden"]


def hide(guides):
    guides.hide_set(True)


def hide_in_viewports(guides):
    guides.hide_viewport = True


def hide_collection(guides):
    collection_of_guides(guides).hide_viewport = True


def hide_collection_in_viewports(guides):
    collection_of_guides(guides).collection.hide_viewport = True


def hide_outer_collection(guides):
    outer = bpy.data.collections.new("Outer")
    bpy.context.scene.collection.children.link(outer)
    collection_of_guides(guides, outer)
    outer.hide_viewport = True


def hide_everywhere(guides):
    hide_collection_in_viewports(guides)
    hide(guides)
    hide_in_viewports(guides)


WAYS = [hide, hide_in_viewports, hide_collection, hide_collection_in_viewports, hide_outer_collection, hide_everywhere]


def comb(guides):
    """Press *Comb Guides* on the surface, and return the guides in Object Mode."""
    bpy.context.view_layer.objects.active = guides.data.surface
    done = bpy.ops.vellus.comb_guides()
    assert (done, guides.mode, bpy.context.object) == ({"FINISHED"}, "SCULPT_CURVES", guides)
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("way", WAYS)
def test_hidden_guides_are_shown_and_combed(guides, way):
    way(guides)
    comb(guides)
    assert guides.visible_get() and guides.select_get()


def test_guides_join_a_local_view(guides):
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        guides.select_set(False)
        bpy.context.view_layer.objects.active = guides.data.surface
        guides.data.surface.select_set(True)
        bpy.ops.view3d.localview()
        assert not guides.visible_get(viewport=area.spaces.active)
        comb(guides)
        assert guides.visible_get(viewport=area.spaces.active)


def refusal(guides):
    bpy.context.view_layer.objects.active = guides.data.surface
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.vellus.comb_guides()
    assert "Traceback" not in str(refused.value) and bpy.context.object == guides.data.surface
    return str(refused.value)


def test_guides_of_an_excluded_collection_are_named(guides):
    collection_of_guides(guides).exclude = True
    assert '"Guides" is not in this view layer' in refusal(guides)


def test_guides_that_a_driver_hides_are_named(guides):
    guides.driver_add("hide_viewport").driver.expression = "1"
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = guides.data.surface
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.vellus.comb_guides()
    assert '"Guides" cannot be combed' in str(refused.value) and "Traceback" not in str(refused.value)
