# SPDX-License-Identifier: GPL-3.0-or-later
"""New hair and meshes are visible with their surface, whatever other collections contain it."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from tests.support.overridden import override, parts, reopen


@pytest.mark.parametrize("way", ["in no scene", "excluded", "hidden"])
def test_what_is_new_is_seen_beside_its_surface(sphere, way):
    listed = bpy.data.collections.new("Colliders")
    listed.objects.link(sphere)
    if way != "in no scene":
        bpy.context.scene.collection.children.link(listed)
        layer = bpy.context.view_layer.layer_collection.children["Colliders"]
        layer.exclude, layer.hide_viewport = way == "excluded", way == "hidden"
    assert sphere.visible_get() and sphere.users_collection[0] == listed
    bpy.ops.vellus.add_hair(guide_count=5, strand_count=20, length=0.2)
    assert bpy.context.object.data.vellus.kind == "HAIR" and bpy.context.object.visible_get()
    assert bpy.data.objects["Hair Guides"].name in bpy.context.view_layer.objects
    bpy.ops.vellus.hair_tubes(tube_count=3)
    (tubes,) = (o for o in bpy.data.objects if o.type == "MESH" and o != sphere)
    assert tubes.visible_get()


def test_hair_stays_in_the_only_collection_of_its_surface(sphere):
    """Hair is in the only collection of its surface, also if that collection is hidden."""
    listed = bpy.data.collections.new("Heads")
    bpy.context.scene.collection.children.link(listed)
    listed.objects.link(sphere)
    bpy.context.scene.collection.objects.unlink(sphere)
    bpy.context.view_layer.objects.active = sphere
    bpy.context.view_layer.layer_collection.children["Heads"].hide_viewport = True
    bpy.ops.vellus.distribute_guides(guide_count=5, length=0.2)
    assert bpy.data.objects["Guides"].users_collection == (listed,)


def test_cards_are_made_beside_a_surface_that_the_view_layer_lacks(hair):
    """All levels of cards are created beside a surface that is not in the view layer, and none is hidden there."""
    sphere = bpy.data.objects["Sphere"]
    kept = bpy.data.collections.new("Heads")
    bpy.context.scene.collection.children.link(kept)
    kept.objects.link(sphere)
    bpy.context.scene.collection.objects.unlink(sphere)
    bpy.context.view_layer.layer_collection.children["Heads"].exclude = True
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.hair_cards(card_count=3, level_count=2, texture_size=128) == {"FINISHED"}
    assert [o.name for o in kept.all_objects if "Cards" in o.name] == ["Hair Cards LOD0", "Hair Cards LOD1"]


def test_what_is_new_on_an_overridden_character_is_in_the_scene(hair, tmp_path):
    """New objects on an overridden character are linked to the scene, because Blender links none to overridden
    collections.
    """
    character = override(hair, tmp_path)
    present, overridden = set(bpy.data.objects), set(character.objects)
    sphere, _guides, _hair = parts()
    listed = bpy.data.collections.new("Colliders")
    bpy.context.scene.collection.children.link(listed)
    listed.objects.link(sphere)
    bpy.context.view_layer.layer_collection.children["Colliders"].hide_viewport = True
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.vellus.add_hair(guide_count=5, strand_count=20, length=0.2)
    made = api.interpolate_hair(api.distribute_guides(sphere, guide_count=5, length=0.2), strand_count=20)
    api.make_hair_tubes(made, tube_count=3)
    api.make_hair_cards(made, card_count=3, texture_size=128)
    new = set(bpy.data.objects) - present
    assert len(new) == 6 and all(o.visible_get() for o in new)
    assert set(character.objects) == overridden
    name, strands = made.name, api.points(made)
    reopen(tmp_path)
    np.testing.assert_allclose(api.points(bpy.data.hair_curves[name]), strands, atol=1e-6)
