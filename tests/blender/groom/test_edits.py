# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair systems are added in one step, found, deleted and repaired, with undo."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.groom.systems import edits
from hair_addon.blender.settings import preferences, saved_looks
from hair_addon.core.errors import HairError
from hair_addon.core.shading.appearance import Appearance
from tests.support.reading import attribute, points, snapshot, vertex_positions, write_points

HAIR_DATA = ("objects", "curves", "materials")


def activate(name):
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name == name)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    return bpy.data.objects[name]


def in_world(curves_object):
    """Return (S, P, 3) points in world space."""
    bpy.context.view_layer.update()
    matrix = np.array(curves_object.matrix_world)
    return points(curves_object) @ matrix[:3, :3].T + matrix[:3, 3]


def test_hair_is_added_in_one_step(sphere):
    assert bpy.ops.vellus.add_hair(guide_count=20, strand_count=100) == {"FINISHED"}
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    assert (len(guides.data.curves), len(hair.data.curves)) == (20, 100)
    assert hair.data.vellus.guide_curves == guides.data
    assert bpy.context.object == hair
    added = points(hair)
    bpy.ops.vellus.interpolate_hair(strand_count=100)  # the same settings, between the guides as they were written
    np.testing.assert_allclose(points(hair), added, atol=1e-5)


def test_one_undo_takes_added_hair_away(sphere):
    before = snapshot()
    bpy.ops.vellus.add_hair("EXEC_DEFAULT", True, guide_count=10, strand_count=20)
    bpy.ops.ed.undo()
    assert snapshot() == before


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_deleting_leaves_nothing_and_undo_brings_it_back(hair, active):
    with_hair = snapshot()
    made = points(hair)
    activate(active)
    bpy.ops.ed.undo_push(message="made")
    bpy.ops.vellus.delete_hair("EXEC_DEFAULT", True)
    assert {name: snapshot()[name] for name in HAIR_DATA} == {"objects": ["Sphere"], "curves": [], "materials": []}
    assert bpy.context.object == bpy.data.objects["Sphere"]
    bpy.ops.ed.undo()
    assert snapshot() == with_hair
    assert np.array_equal(points(bpy.data.objects["Hair"]), made)


def test_guides_stay_while_other_hair_follows_them(guides):
    bpy.ops.vellus.interpolate_hair(strand_count=10)
    activate("Guides")
    bpy.ops.vellus.interpolate_hair(strand_count=20)
    activate("Hair.001")
    bpy.ops.vellus.delete_hair()
    assert sorted(bpy.data.hair_curves.keys()) == ["Guides", "Hair"]
    activate("Hair")
    bpy.ops.vellus.delete_hair()
    assert not bpy.data.hair_curves


def test_guides_that_nothing_follows_any_more_are_no_orphans(hair):
    """Delete Hair also deletes guides whose object was deleted and which are on another mesh than the hair."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    bpy.data.objects["Guides"].data.surface = bpy.context.object
    bpy.data.objects.remove(bpy.data.objects["Guides"])
    activate("Sphere")
    bpy.ops.vellus.delete_hair()
    assert not bpy.data.hair_curves


def test_parts_are_found_from_one_another(hair):
    for start, operator, found in (
        ("Sphere", "select_guides", "Guides"),
        ("Guides", "select_hair", "Hair"),
        ("Hair", "select_guides", "Guides"),
        ("Sphere", "select_hair", "Hair"),
    ):
        activate(start)
        getattr(bpy.ops.vellus, operator)()
        assert [bpy.context.object.name] == [o.name for o in bpy.context.selected_objects] == [found]


def test_combing_begins_on_the_guides(hair):
    bpy.ops.vellus.comb_guides()
    assert (bpy.context.object.name, bpy.context.mode) == ("Guides", "SCULPT_CURVES")


def test_drawing_is_switched_for_the_active_hair_or_for_all(hair):
    bpy.ops.vellus.toggle_drawing()
    assert not hair.data.vellus.is_drawn and hair.display_type == "TEXTURED"
    activate("Sphere")
    bpy.ops.vellus.toggle_drawing()
    assert hair.data.vellus.is_drawn and hair.display_type != "TEXTURED"


# -------------------------------------------------------------------------------------------------- mended surfaces


def test_a_uv_map_is_made_without_overlaps_and_hair_knows_it(hair):
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    combed = points(guides)
    combed[:, -1] += 0.1
    write_points(guides, combed)
    bpy.ops.vellus.make_uv_map()
    assert [layer.name for layer in sphere.data.uv_layers] == [hair.data.surface_uv_map] == ["Hair"]
    assert np.array_equal(points(guides), combed)
    for curves_object in (hair, guides):
        uvs = attribute(curves_object, "surface_uv_coordinate", 2)
        assert len(np.unique(uvs, axis=0)) == len(uvs)
    share = edits.check_uvs(sphere, bpy.context.evaluated_depsgraph_get())
    assert share == 0.0


def test_an_artists_own_uv_map_is_kept(hair):
    sphere = bpy.data.objects["Sphere"]
    before = np.empty(2 * len(sphere.data.loops), np.float32)
    sphere.data.uv_layers[0].uv.foreach_get("vector", before)
    bpy.ops.vellus.make_uv_map()
    after = np.empty_like(before)
    sphere.data.uv_layers[0].uv.foreach_get("vector", after)
    assert np.array_equal(after, before) and len(sphere.data.uv_layers) == 2


def test_overlaps_are_found_when_asked_for(hair):
    sphere = bpy.data.objects["Sphere"]
    uvs = sphere.data.uv_layers[0].uv
    one_triangle = np.tile(np.array([0, 0, 1, 0, 0, 1], np.float32), len(sphere.data.polygons))
    uvs.foreach_set("vector", one_triangle)
    bpy.ops.vellus.check_uvs()
    assert hair.data.vellus.uv_status
    bpy.ops.vellus.make_uv_map()
    assert not hair.data.vellus.uv_status


def test_a_mesh_that_blender_cannot_unwrap_is_refused(hair):
    sphere = bpy.data.objects["Sphere"]
    count = len(sphere.data.uv_layers)
    sphere.data.transform(Matrix.Scale(1e12, 4))
    with pytest.raises(RuntimeError, match="too large to unwrap"):
        bpy.ops.vellus.make_uv_map()
    assert len(sphere.data.uv_layers) == count


def test_a_renamed_uv_map_is_found_again(hair):
    bpy.data.objects["Sphere"].data.uv_layers[0].name = "Other"
    bpy.ops.vellus.use_uv_map()
    assert {c.surface_uv_map for c in bpy.data.hair_curves} == {"Other"}


@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (1.0, 3.0, 0.5), (-1.0, 1.0, 1.0)])
def test_applying_the_scale_moves_nothing(sphere, scale):
    """Applying the scale moves neither the mesh nor its hair, at once or when the hair is regenerated."""
    sphere.scale = scale
    bpy.context.view_layer.update()
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=50)
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    combed = points(guides)
    combed[:, -1] += 0.05
    write_points(guides, combed)
    before = in_world(guides), in_world(hair), vertex_positions(sphere) * scale
    radius = attribute(hair, "radius") * abs(np.prod(scale)) ** (1.0 / 3.0)
    bpy.ops.vellus.apply_scale()
    bpy.context.view_layer.update()
    assert tuple(sphere.scale) == (1.0, 1.0, 1.0)
    np.testing.assert_allclose(vertex_positions(sphere), before[2], atol=1e-6)
    np.testing.assert_allclose(in_world(guides), before[0], atol=1e-5)
    np.testing.assert_allclose(attribute(hair, "radius"), radius, rtol=1e-4)
    np.testing.assert_allclose(in_world(hair), before[1], atol=1e-4)


def test_scale_of_a_shared_mesh_is_left_alone(hair):
    sphere = bpy.data.objects["Sphere"]
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", sphere.data))
    sphere.scale = (2.0, 2.0, 2.0)
    with pytest.raises(RuntimeError, match="single-user"):
        bpy.ops.vellus.apply_scale()
    assert tuple(sphere.scale) == (2.0, 2.0, 2.0)


def test_guides_whose_object_was_deleted_come_back(hair):
    made = points(bpy.data.objects["Guides"])
    bpy.context.view_layer.objects.active = hair
    bpy.data.objects.remove(bpy.data.objects["Guides"])  # the view layer lists it as None until its next update
    bpy.ops.vellus.restore_guides()
    restored = bpy.data.objects["Guides"]
    assert restored.parent == bpy.data.objects["Sphere"]
    assert np.array_equal(points(restored), made)


def test_guides_without_object_and_surface_wait_for_a_surface(hair):
    bpy.context.view_layer.objects.active = hair
    bpy.data.batch_remove([bpy.data.objects["Guides"], bpy.data.objects["Sphere"]])
    with pytest.raises(RuntimeError, match="surface is missing"):
        bpy.ops.vellus.restore_guides()


def test_a_flat_surface_is_not_attached_to(hair):
    """Attaching hair to a surface with a scale of zero is refused, as its coordinates have no inverse."""
    before = points(hair)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1.0)
    other = bpy.context.object
    other.scale.z = 0.0
    bpy.context.view_layer.update()
    activate("Hair")
    other.select_set(True)
    with pytest.raises(RuntimeError, match="has a scale of zero: change its scale"):
        bpy.ops.vellus.attach_to_surface()
    assert hair.data.surface == bpy.data.objects["Sphere"] and np.array_equal(points(hair), before)


def test_hair_that_lost_its_surface_is_attached_to_another(hair):
    bpy.data.objects.remove(bpy.data.objects["Sphere"])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=1.0)
    other = bpy.context.object
    activate("Hair")
    other.select_set(True)
    bpy.ops.vellus.attach_to_surface()
    bpy.context.view_layer.update()
    assert hair.data.surface == hair.parent == bpy.data.objects["Guides"].parent == other
    assert hair.data.vellus.status == ""
    distance = np.linalg.norm(points(hair)[:, 0], axis=1)
    np.testing.assert_allclose(distance, 1.0, atol=0.02)


# ------------------------------------------------------------------------------------------------------- saved looks


@pytest.fixture
def user_folder(tmp_path, monkeypatch):
    """Return the add-on's own folder, as if it were installed."""
    monkeypatch.setattr(preferences, "ADDON_MODULE", "bl_ext.user_default.vellus")
    monkeypatch.setattr(bpy.utils, "extension_path_user", lambda _module, *, path, create: str(tmp_path / path))
    (tmp_path / "looks").mkdir()
    return tmp_path / "looks"


def test_a_look_is_saved_applied_and_removed(hair, user_folder):
    look = Appearance(melanin=0.31, tint=(0.2, 0.4, 0.6), roughness=0.55)
    saved_looks.write("My look", look)
    assert saved_looks.names() == ["My look"]
    assert saved_looks.read("My look") == look
    bpy.ops.vellus.apply_saved_look(name="My look")
    assert hair.data.vellus.appearance.melanin == pytest.approx(0.31)
    bpy.ops.vellus.save_look(name="Again")
    assert saved_looks.read("Again").tint == pytest.approx(look.tint)
    bpy.ops.vellus.remove_look(name="My look")
    assert saved_looks.names() == ["Again"]


DAMAGED = ["", "{", "[1]", "null", '{"melanin": "much"}', '{"melanin": 7}', '{"tint": 3}', '{"tint": [1]}', "[" * 9999]


@pytest.mark.parametrize("text", DAMAGED, ids=lambda text: text[:20])
def test_a_damaged_look_is_refused(hair, user_folder, text):
    (user_folder / "bad.json").write_text(text)
    before = hair.data.vellus.appearance.melanin
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.vellus.apply_saved_look(name="bad")
    assert "Traceback" not in str(refused.value)
    assert hair.data.vellus.appearance.melanin == before


@pytest.mark.parametrize("name", ["", "  ", "..", "/"])
def test_a_look_needs_a_name(user_folder, name):
    with pytest.raises(HairError, match="name"):
        saved_looks.write(name, Appearance())


@pytest.mark.parametrize("name", ["../outside", "a/b\\c", "C:x", "nul\0"])
def test_a_look_stays_in_its_folder(user_folder, name):
    saved_looks.write(name, Appearance(melanin=0.4))
    assert {path.parent for path in user_folder.parent.rglob("*.json")} == {user_folder}
    assert saved_looks.read(name) == Appearance(melanin=0.4)


def test_unknown_settings_of_a_later_look_are_ignored(user_folder):
    (user_folder / "later.json").write_text('{"version": 9, "melanin": 0.4, "sparkle": true}')
    assert saved_looks.read("later") == Appearance(melanin=0.4)
