# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms on unusable meshes and unusable curves give one message and leave nothing behind."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, world
from tests.support.reading import snapshot


@pytest.fixture
def target(hair):
    """Add a second sphere beside the hairy one."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, location=(3.0, 0.0, 0.0))
    bpy.context.object.name = "Target"
    update()
    return bpy.context.object


@pytest.fixture
def lines(sphere, rng):
    return curves_object(list(lines_on(sphere, rng, 30, least=5)))


def without_faces(target):
    target.data.clear_geometry()


def in_edit_mode(target):
    select(target)
    bpy.ops.object.mode_set(mode="EDIT")


def hidden_in_viewports(target):
    target.hide_viewport = True


PLACES = {without_faces: "no faces", in_edit_mode: "is in Edit Mode", hidden_in_viewports: "is hidden in viewports"}


@pytest.mark.parametrize("place", PLACES)
def test_a_mesh_that_cannot_take_a_groom_is_one_sentence(hair, target, tmp_path, place):
    file = api.save_groom(hair, tmp_path / "Bob.blend", picture=np.zeros((4, 4, 4)))
    place(target)
    before = snapshot()
    for come in (lambda: api.transfer_groom(hair, target), lambda: api.apply_groom(target, file)):
        with pytest.raises(api.HairError, match=PLACES[place]):
            come()
    assert snapshot() == before
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
        return
    select(hair)
    with pytest.raises(RuntimeError, match=PLACES[place]):
        bpy.ops.vellus.transfer_groom(target="Target")


@pytest.mark.parametrize("operator", ["use_as_guides", "use_as_hair"])
def test_curves_on_a_mesh_that_viewports_hide_are_one_sentence(sphere, lines, operator):
    """Curves on a mesh that viewports hide are refused with one sentence, as its modifiers and transform may be
    outdated.
    """
    before = stored(lines).copy()
    hidden_in_viewports(sphere)
    update()
    select(lines)
    with pytest.raises(RuntimeError, match="is hidden in viewports"):
        getattr(bpy.ops.vellus, operator)(surface="Sphere")
    assert lines.data.vellus.kind == "NONE" and np.array_equal(stored(lines), before)


@pytest.fixture
def linked_mesh(target, tmp_path):
    """Return the second sphere as a local object whose mesh is linked."""
    path, mesh = tmp_path / "library.blend", target.data
    bpy.data.libraries.write(str(path), {mesh})
    name = mesh.name
    with bpy.data.libraries.load(str(path), link=True) as (_there, here):
        here.meshes = [name]
    target.data = here.meshes[0]
    update()
    return target


def test_masks_are_not_painted_on_a_linked_mesh(hair, sphere, linked_mesh, rng, tmp_path):
    """Masks are not painted on a linked mesh, where Blender would lose them when the file is opened again."""
    hair.data.vellus.guide_curves.vellus.guides.density_group = "top"
    update()
    file = api.save_groom(hair, tmp_path / "Bob.blend", picture=np.zeros((4, 4, 4)))
    cap = [line for line in lines_on(linked_mesh, rng, 60) if line[0, 2] > 0.5]
    drawn = curves_object(cap)
    before, is_linked = snapshot(), "is linked from another file"
    for come in (lambda: api.transfer_groom(hair, linked_mesh), lambda: api.apply_groom(linked_mesh, file)):
        with pytest.raises(api.HairError, match=is_linked):
            come()
    select(linked_mesh, drawn)
    with pytest.raises(RuntimeError, match=is_linked):
        bpy.ops.vellus.use_as_guides(strand_count=20)
    assert snapshot() == before and drawn.data.vellus.kind == "NONE" and not linked_mesh.vertex_groups
    assert bpy.ops.vellus.use_as_guides(strand_count=20, grows_hair=False) == {"FINISHED"}


def test_a_linked_groom_is_saved_under_the_name_of_its_hair(hair, tmp_path):
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {hair})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        here.objects = list(there.objects)
    for linked in here.objects:
        bpy.context.scene.collection.objects.link(linked)
    update()
    saved = api.save_groom(bpy.data.objects["Hair"], tmp_path / "Hair.blend", picture=np.zeros((4, 4, 4)))
    assert api.groom_names(saved) == ["Hair"]


@pytest.mark.parametrize("bevel", [0.0, 0.002])
def test_curve_objects_become_hair_as_thick_as_their_bevel(sphere, rng, bevel):
    """Curve objects become hair as thick as their bevel, as their points' radius of 1 is a factor."""
    drawn = bpy.data.curves.new("Drawn", "CURVE")
    drawn.dimensions, drawn.bevel_depth = "3D", bevel
    for line in lines_on(sphere, rng, 20):
        spline = drawn.splines.new("POLY")
        spline.points.add(len(line) - 1)
        spline.points.foreach_set("co", np.column_stack([line, np.ones(len(line))]).astype(np.float32).ravel())
    made = bpy.data.objects.new("Drawn", drawn)
    bpy.context.scene.collection.objects.link(made)
    update()
    used = api.use_as_hair(made, sphere, guide_count=5)
    radii = np.empty(len(used.hair.points), np.float32)
    used.hair.attributes["radius"].data.foreach_get("value", radii)
    if bevel:
        np.testing.assert_allclose(radii, bevel, rtol=1e-6)
    else:
        assert 1e-4 < radii.min() and radii.max() < 0.01


def test_curves_that_cannot_be_used_are_one_sentence_and_stay(sphere, lines):
    empty = bpy.data.objects.new("Empty", bpy.data.curves.new("Empty", "CURVE"))
    bpy.context.scene.collection.objects.link(empty)
    update()
    with pytest.raises(api.HairError, match='"Empty" has no curves yet'):
        api.use_as_hair(empty, sphere)
    sphere.scale = (1e12,) * 3
    update()
    before = world(lines)
    with pytest.raises(api.HairError, match="too small or too far away"):
        api.use_as_hair(lines, sphere)
    assert lines.data.vellus.kind == "NONE" and np.array_equal(world(lines), before)


def test_hair_thicker_than_settings_allow_comes_as_it_is(sphere, lines):
    lines.data.attributes.new("radius", "FLOAT", "POINT")
    thick = np.full(len(lines.data.points), 5000.0, np.float32)
    lines.data.attributes["radius"].data.foreach_set("value", thick)
    update()
    used = api.use_as_hair(lines, sphere, guide_count=5)
    radii = np.empty_like(thick)
    used.hair.attributes["radius"].data.foreach_get("value", radii)
    assert np.array_equal(radii, thick) and used.hair.vellus.guide_curves == used.guides
