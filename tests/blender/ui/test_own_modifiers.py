# SPDX-License-Identifier: GPL-3.0-or-later
"""The Shading panel names an artist's own modifiers on hair that viewports do not show."""

import bpy
import pytest

from tests.support.interface.layout import draw

NODE_ASSETS = bpy.utils.system_resource("DATAFILES", path="assets/nodes") + "/procedural_hair_node_assets.blend"


def notes(active="Hair"):
    """Return the Shading panel's notes about modifiers."""
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    reported = " ".join(draw(bpy.types.VELLUS_PT_shading).texts)
    return reported if "renders only" in reported else ""


def add_asset(hair, name):
    """Add a modifier with one of Blender's own hair node groups."""
    with bpy.data.libraries.load(NODE_ASSETS, link=False, assets_only=True) as (_, wanted):
        wanted.node_groups = [name]
    modifier = hair.modifiers.new(name, "NODES")
    modifier.node_group = wanted.node_groups[0]
    return modifier


def test_the_modifier_that_follows_the_surface_is_not_mentioned(hair):
    assert len(hair.modifiers) == 1 and not notes()


@pytest.mark.parametrize("active", ["Hair", "Guides", "Sphere"])
def test_modifiers_that_only_renders_show_are_counted_and_named(hair, active):
    clump, curl = (add_asset(hair, f"{name} Hair Curves") for name in ("Clump", "Curl"))
    assert not notes(active)
    clump.show_viewport = False
    assert "1 modifier shows" in notes(active) and clump.name in notes(active)
    curl.show_viewport = False
    assert "2 modifiers show" in notes(active) and clump.name in notes(active) and curl.name in notes(active)
    clump.show_render = False
    assert "1 modifier shows" in notes(active) and clump.name not in notes(active)


def test_hair_that_blender_draws_shows_its_modifiers(hair):
    add_asset(hair, "Clump Hair Curves").show_viewport = False
    assert notes()
    assert bpy.ops.vellus.toggle_drawing() == {"FINISHED"}
    assert not notes()


def test_hair_without_an_object_has_no_panel(hair):
    add_asset(hair, "Clump Hair Curves").show_viewport = False
    assert notes("Sphere")
    hair.data.use_fake_user = True
    bpy.data.objects.remove(hair)
    assert draw(bpy.types.VELLUS_PT_shading) is None
