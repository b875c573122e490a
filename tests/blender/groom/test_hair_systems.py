# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of hair systems has a row for each system of a mesh, an edited row, and buttons."""

import bpy
import pytest

from hair_addon.blender.groom.selection import object_of, surface_of
from hair_addon.blender.groom.systems.hair_systems import systems_of
from hair_addon.blender.materials import looks
from tests.blender.groom.test_edits import activate
from tests.support.interface.layout import draw, draw_all


def add_system(name, strand_count=30):
    """Add a hair system to the sphere; its hair is active."""
    activate("Sphere")
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=strand_count)
    bpy.context.object.vellus_system.title = name
    return bpy.context.object


@pytest.fixture
def systems(sphere):
    """Return two systems on the sphere and one on another mesh; the second system is active."""
    other = bpy.data.objects.new("Other", sphere.data)
    bpy.context.scene.collection.objects.link(other)
    activate("Other")
    bpy.ops.vellus.add_hair(guide_count=10, strand_count=30)
    bpy.context.object.vellus_system.title = "Elsewhere"
    return [add_system("Long"), add_system("Brows")]


def listed():
    """Return the names of the rows, and the name of the edited row or None."""
    view_layer = bpy.context.view_layer
    rows = [object_of(curves, view_layer) for curves in systems_of(surface_of(bpy.context.object), view_layer)]
    index = view_layer.vellus_system
    return sorted(row.vellus_system.title for row in rows), None if index < 0 else bpy.data.hair_curves[index].name


def click(name):
    bpy.context.view_layer.vellus_system = bpy.data.hair_curves.find(name)
    bpy.context.view_layer.update()


def test_the_list_shows_the_systems_of_the_active_mesh_and_the_panel_draws_them(systems):
    assert listed() == (["Brows", "Long"], "Brows")
    drawn = draw(bpy.types.VELLUS_PT_systems).drawn
    counts = ("title", "is_visible", "hide_render", "vellus.add_hair", "vellus.delete_system", "show_guides")
    assert [drawn[name] for name in counts] == [2, 2, 2, 1, 1, 1]
    activate("Elsewhere")
    assert listed() == (["Elsewhere"], "Elsewhere")


def test_the_row_follows_the_active_object(systems):
    for active, row in (("Long", "Long"), ("Brows", "Brows"), ("Long Guides", "Long"), ("Sphere", "Brows")):
        activate(active)
        assert listed()[1] == row, active


def test_a_click_selects_the_hair_of_a_row(systems):
    click("Long")
    assert bpy.context.object.name == "Long"
    assert [o.name for o in bpy.context.selected_objects] == ["Long"]
    activate("Sphere")
    click("Long")
    assert bpy.context.object.name == "Long"


def test_a_click_while_guides_are_combed_goes_to_the_guides_of_the_row(systems):
    bpy.ops.vellus.comb_guides()
    assert bpy.context.object.data == systems[1].data.vellus.guide_curves
    click("Long")
    assert bpy.context.object.data == bpy.data.objects["Long"].data.vellus.guide_curves
    assert bpy.context.mode == "SCULPT_CURVES"
    assert [o.mode for o in bpy.data.objects if o.mode != "OBJECT"] == ["SCULPT_CURVES"]


def test_guides_without_hair_are_a_system(systems):
    activate("Sphere")
    bpy.ops.vellus.distribute_guides(guide_count=5)
    alone = next(c for c in bpy.data.hair_curves if len(c.curves) == 5)
    activate(alone.name)
    assert listed() == (sorted(["Brows", "Long", alone.name]), alone.name)
    bpy.ops.vellus.interpolate_hair(strand_count=7)
    activate(next(o.name for o in bpy.data.objects if o.type == "CURVES" and len(o.data.curves) == 7))
    assert listed() == (sorted(["Brows", "Long", bpy.context.object.name]), bpy.context.object.name)


def test_a_name_is_given_to_the_object_and_its_curves_and_undone(systems):
    bpy.ops.ed.undo_push(message="systems")
    bpy.data.objects["Long"].vellus_system.title = "Beard"
    assert (bpy.data.objects["Beard"].data.name, listed()[0]) == ("Beard", ["Beard", "Brows"])
    bpy.data.objects["Beard"].vellus_system.title = "  "
    assert "Beard" in bpy.data.objects
    bpy.ops.ed.undo_push(message="renamed")
    bpy.ops.ed.undo()
    assert listed()[0] == ["Brows", "Long"]


def test_the_eye_hides_hair_from_viewports_and_the_camera_from_renders(systems):
    hair = systems[1]
    hair.vellus_system.is_visible = False
    assert (hair.visible_get(), hair.hide_render) == (False, False)
    assert listed() == (["Brows", "Long"], "Brows")
    hair.vellus_system.is_visible = True
    assert hair.visible_get()


def test_deleting_a_row_leaves_the_others_alone(systems):
    """Deleting a row deletes only its hair, also if the mesh is active, in which case Delete Hair would delete all
    hair.
    """
    activate("Sphere")
    bpy.ops.ed.undo_push(message="systems")
    bpy.ops.vellus.delete_system("EXEC_DEFAULT", True)
    assert listed() == (["Long"], "Long")
    assert len(bpy.data.hair_curves) == 4  # two systems, each of hair and guides
    bpy.ops.ed.undo()
    assert listed() == (["Brows", "Long"], "Brows")


def test_a_row_is_deleted_without_its_mesh_in_the_view_layer(systems):
    """A row is deleted although its mesh is in a collection that the view layer excludes."""
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    sphere = bpy.data.objects["Sphere"]
    bpy.context.scene.collection.objects.unlink(sphere)
    hidden.objects.link(sphere)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True
    activate("Brows")
    bpy.ops.vellus.delete_system()
    assert "Brows" not in bpy.data.objects


def test_guides_that_other_hair_follows_survive_a_system(systems):
    guides = systems[1].data.vellus.guide_curves
    activate(bpy.data.objects["Brows Guides"].name)
    bpy.ops.vellus.interpolate_hair(strand_count=9)
    activate("Brows")
    bpy.ops.vellus.delete_system()
    assert guides.name in bpy.data.hair_curves


def test_hair_deleted_by_other_means_leaves_the_list(systems):
    bpy.data.objects.remove(systems[1])
    bpy.context.view_layer.update()
    activate("Sphere")
    assert listed() == (["Brows Guides", "Long"], "Long")


def test_another_view_layer_lists_what_it_has(systems):
    collection = bpy.data.collections.new("Brows")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(systems[1])
    bpy.context.scene.collection.objects.unlink(systems[1])
    activate("Sphere")
    bpy.context.view_layer.layer_collection.children["Brows"].exclude = True
    bpy.context.view_layer.update()
    assert "Brows" not in listed()[0] and "Long" in listed()[0]


def test_a_system_is_added_while_hair_is_active(systems):
    assert bpy.context.object == systems[1]
    assert bpy.ops.vellus.add_hair(guide_count=5, strand_count=20) == {"FINISHED"}
    assert bpy.context.object.data.surface == bpy.data.objects["Sphere"]
    assert len(listed()[0]) == 3


def test_an_empty_list_offers_a_new_system_and_nothing_active_no_list(sphere):
    drawn = draw_all([bpy.types.VELLUS_PT_systems])
    assert (drawn["template_list"], drawn["vellus.add_hair"]) == (0, 1)
    bpy.context.view_layer.objects.active = None
    assert draw(bpy.types.VELLUS_PT_systems) is None
    assert bpy.context.view_layer.vellus_system == -1


def test_guides_are_hidden_once_they_have_hair_unless_they_are_to_be_shown(guides):
    assert looks.are_guides_shown(guides.data) and guides.display_type == "TEXTURED"
    bpy.ops.vellus.interpolate_hair(strand_count=10)
    assert not looks.are_guides_shown(guides.data) and guides.display_type == "BOUNDS"
    guides.data.vellus.show_guides = True
    bpy.context.view_layer.update()
    assert looks.are_guides_shown(guides.data) and guides.display_type == "TEXTURED"
    guides.data.vellus.show_guides = False
    bpy.context.view_layer.update()
    assert guides.display_type == "BOUNDS"
    bpy.data.objects.remove(bpy.data.objects["Hair"])
    bpy.context.view_layer.update()
    assert looks.are_guides_shown(guides.data) and guides.display_type == "TEXTURED"
