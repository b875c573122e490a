# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of hair by each of Blender's commands have guides of their own, or a message and a button."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import pipeline
from hair_addon.blender.groom.selection import parts_of
from hair_addon.blender.groom.systems import copied_hair, diagnostics
from tests.support.interface.layout import draw
from tests.support.reading import evaluated_points, points, write_points


def select(*names):
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]


def comb(guides, amount=0.2):
    combed = points(guides)
    combed[:, -1] += amount
    write_points(guides, combed)


@pytest.fixture
def second(hair):
    """Add another hair system on the same sphere."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    bpy.ops.vellus.add_hair(guide_count=30, strand_count=80, length=0.2)
    made = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR" and o != hair)
    made.name, made.data.vellus.guide_curves.name = "Second", "Second Guides"
    next(o for o in bpy.data.objects if o.data == made.data.vellus.guide_curves).name = "Second Guides"
    return made


ALL = ("Sphere", "Guides", "Hair", "Second Guides", "Second")


def single_user(*names):
    select(*names)
    bpy.ops.object.make_single_user(type="SELECTED_OBJECTS", object=True, obdata=True)
    bpy.context.view_layer.update()


def alt_d_then_single_user():
    select(*ALL)
    bpy.ops.object.duplicate(linked=True)
    single_user(*(f"{name}.001" for name in ALL))


def alt_d_then_single_user_one_after_another():
    """Copy hair before guides, and guides before hair."""
    select(*ALL)
    bpy.ops.object.duplicate(linked=True)
    for name in ("Sphere", "Hair", "Guides", "Second Guides", "Second"):
        single_user(f"{name}.001")


def linked_scene_then_single_user():
    bpy.ops.scene.new(type="LINK_COPY")
    bpy.ops.object.make_single_user(type="ALL", object=True, obdata=True)
    bpy.context.view_layer.update()


def full_copy():
    bpy.ops.scene.new(type="FULL_COPY")
    bpy.context.view_layer.update()


def shift_d():
    select(*ALL)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()


@pytest.mark.parametrize(
    "copy",
    [
        shift_d,
        alt_d_then_single_user,
        alt_d_then_single_user_one_after_another,
        linked_scene_then_single_user,
        full_copy,
    ],
)
def test_a_copied_head_has_hair_and_guides_of_its_own(hair, second, copy):
    before = points(hair), points(second)
    copy()
    copies = {name: bpy.data.objects[f"{name}.001"] for name in ALL}
    assert all(np.array_equal(points(copies[name]), old) for name, old in zip(("Hair", "Second"), before, strict=True))
    for name in ALL[1:]:
        assert copies[name].data.surface == copies["Sphere"]
    for name, guides in (("Hair", "Guides"), ("Second", "Second Guides")):
        assert copies[name].data.vellus.guide_curves == copies[guides].data
    assert diagnostics.warnings_of(copies["Sphere"], parts_of(copies["Sphere"])) == []
    comb(copies["Guides"])
    assert all(np.array_equal(points(one), old) for one, old in zip((hair, second), before, strict=True))
    assert not np.array_equal(points(copies["Hair"]), before[0])
    assert np.array_equal(points(copies["Second"]), before[1])


def test_nothing_is_computed_again_for_a_copy(hair, second, monkeypatch):
    monkeypatch.setattr(pipeline, "evaluate", lambda *_args: pytest.fail("hair is computed again"))
    alt_d_then_single_user()


def test_hair_and_guides_of_one_surface_may_be_made_single_user(hair):
    select("Guides", "Hair")
    bpy.ops.object.duplicate(linked=True)
    single_user("Guides.001", "Hair.001")
    assert bpy.data.hair_curves["Hair.001"].vellus.guide_curves == bpy.data.hair_curves["Guides.001"]


def test_hair_that_is_duplicated_with_its_surface_alone_says_so_until_it_has_guides(hair):
    select("Sphere", "Hair")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    sphere, copy = bpy.data.objects["Sphere.001"], bpy.data.objects["Hair.001"]
    sphere.location.x = 4.0
    bpy.context.view_layer.update()
    before = points(hair), points(copy), evaluated_points(copy)
    for active in (sphere, copy):
        bpy.context.view_layer.objects.active = active
        shown = draw(bpy.types.VELLUS_PT_surface)
        assert shown.drawn["vellus.make_own_guides"] == 1
        assert '"Hair.001" follows guides that grow on "Sphere"' in " ".join(shown.texts)
    bpy.ops.vellus.make_own_guides()
    bpy.context.view_layer.update()
    guides = copy.data.vellus.guide_curves
    (owner,) = [o for o in bpy.data.objects if o.data == guides]
    assert (guides.surface, owner.parent) == (sphere, sphere)
    assert draw(bpy.types.VELLUS_PT_surface).drawn["vellus.make_own_guides"] == 0
    assert all(np.array_equal(points(one), old) for one, old in zip((hair, copy), before, strict=False))
    np.testing.assert_array_equal(evaluated_points(copy), before[2])
    comb(bpy.data.objects["Guides"])
    assert np.array_equal(points(copy), before[1]) and not np.array_equal(points(hair), before[0])
    comb(owner, 0.2)
    np.testing.assert_allclose(points(copy), points(hair), atol=1e-6)
    for vertex in sphere.data.vertices:  # its own surface is what it follows
        vertex.co *= 1.5
    sphere.data.update()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(copy)[:, 0], 1.5 * points(hair)[:, 0], atol=1e-5)


def test_a_linked_duplicate_of_a_surface_with_its_hair_may_be_moved_without_a_warning(hair):
    select("Sphere", "Guides", "Hair")
    bpy.ops.object.duplicate(linked=True)
    sphere, copy = bpy.data.objects["Sphere.001"], bpy.data.objects["Hair.001"]
    assert copy.parent == sphere and copy.data == hair.data
    sphere.location.x = 4.0
    bpy.context.view_layer.update()
    for active in (bpy.data.objects["Sphere"], copy):
        bpy.context.view_layer.objects.active = active
        assert draw(bpy.types.VELLUS_PT_surface).drawn["vellus.attach_to_surface"] == 0


def test_own_guides_on_a_surface_of_another_shape_give_strands_new_roots(hair):
    """On a surface of another shape, Make Own Guides gives strands new roots."""
    bpy.ops.mesh.primitive_cube_add(size=3.0)
    cube = bpy.context.object
    hair.data.surface, hair.parent = cube, cube
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.make_own_guides()
    bpy.context.view_layer.update()
    assert hair.data.vellus.guide_curves.surface == cube and hair.data.vellus.status == ""
    np.testing.assert_allclose(abs(points(hair)[:, 0]).max(axis=-1), 1.5, atol=1e-5)


def test_hair_that_is_duplicated_alone_follows_the_same_guides_and_says_which(hair):
    assert draw(bpy.types.VELLUS_PT_interpolation).drawn["vellus.make_own_guides"] == 0
    select("Hair")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = bpy.data.objects["Hair.001"]
    for active, other in ((hair, "Hair.001"), (copy, "Hair")):
        bpy.context.view_layer.objects.active = active
        shown = draw(bpy.types.VELLUS_PT_interpolation)
        assert shown.drawn["vellus.make_own_guides"] == 1
        assert f"Other hair follows the same guides: {other}" in " ".join(shown.texts)
    bpy.ops.vellus.make_own_guides()
    before = points(copy)
    comb(bpy.data.objects["Guides"])
    assert np.array_equal(points(copy), before) and not np.array_equal(points(hair), before)
    assert copied_hair.sharing(hair.data) == []
    assert not bpy.ops.vellus.make_own_guides.poll()


def test_pasted_into_another_file(hair, second):
    before = points(hair)
    for names, warned in ((ALL, []), (("Sphere", "Hair"), ["vellus.restore_guides"])):
        select(*names)
        bpy.ops.view3d.copybuffer()
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.view3d.pastebuffer()
        bpy.context.view_layer.update()
        sphere = bpy.data.objects["Sphere"]
        assert [warning.operator for warning in diagnostics.warnings_of(sphere, parts_of(sphere))] == warned
        np.testing.assert_array_equal(points(bpy.data.objects["Hair"]), before)


def test_what_was_deleted_together_is_not_missed(hair, second):
    """Objects that were deleted together are not missed, although Blender keeps their Curves until the file is
    saved.
    """
    select("Guides", "Hair")
    bpy.ops.object.delete()
    sphere = bpy.data.objects["Sphere"]
    assert "Hair" in bpy.data.hair_curves
    assert diagnostics.warnings_of(sphere, parts_of(sphere)) == []
    assert set(parts_of(sphere)) == {second.data, second.data.vellus.guide_curves}
    select("Second Guides")
    bpy.ops.object.delete()
    assert [one.operator for one in diagnostics.warnings_of(sphere, parts_of(sphere))] == ["vellus.restore_guides"]
