# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept hair follows the guides that were derived from it."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.live import live_hair
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, world


@pytest.fixture
def scale():
    """Return the scale of the sphere; also a parameter of tests."""
    return 1.0


@pytest.fixture
def kept(sphere, rng, scale):
    """Return kept hair on the sphere, of 5 to 12 points a strand, with 40 guides."""
    sphere.scale = (scale, scale, scale)
    update()
    hair = curves_object(list(lines_on(sphere, rng, 300, least=5)))
    select(sphere, hair)
    bpy.ops.vellus.use_as_hair(guide_count=40)
    update()
    return hair


def guides_of(hair):
    return hair.data.vellus.guide_curves


def comb(guides, arms):
    """Multiply guides by (3, 3) from their roots, where a (G, 1, 1) factor is 1."""
    points = curves.read_points(guides).reshape(len(guides.curves), -1, 3)
    write(guides, points[:, :1] + (points - points[:, :1]) @ np.asarray(arms).T)


def write(datablock, points):
    datablock.attributes["position"].data.foreach_set("vector", np.asarray(points, np.float32).ravel())
    datablock.update_tag()
    update()


def strands_of(hair):
    return np.split(stored(hair), curves.curve_offsets(hair.data)[1:-1])


STRETCH = 1.3 * np.eye(3)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_strands_grow_as_their_guides_do(kept):
    """Strands become longer with their guides, and their roots stay."""
    before = strands_of(kept)
    comb(guides_of(kept), STRETCH)
    for strand, was in zip(strands_of(kept), before, strict=True):
        np.testing.assert_allclose(strand[0], was[0], atol=1e-5)
        np.testing.assert_allclose(strand[-1] - strand[0], 1.3 * (was[-1] - was[0]), atol=0.03)
    assert kept.data.vellus.status == ""


def test_guides_put_back_give_every_bit_of_the_hair_back(kept):
    before, guides = stored(kept), guides_of(kept)
    combed = curves.read_points(guides)
    comb(guides, STRETCH)
    assert np.abs(stored(kept) - before).max() > 0.05
    write(guides, combed)
    assert np.array_equal(stored(kept), before)


def test_strands_depend_on_where_guides_are_and_not_on_their_way_there(kept):
    guides = guides_of(kept)
    combed = curves.read_points(guides)
    comb(guides, STRETCH)
    expected = stored(kept)
    write(guides, combed + np.random.default_rng(1).normal(scale=0.05, size=combed.shape))
    write(guides, combed)
    comb(guides, STRETCH)
    np.testing.assert_allclose(stored(kept), expected, atol=2e-5)


def test_one_guide_moves_the_strands_near_it_alone(kept):
    guides = guides_of(kept)
    points = curves.read_points(guides).reshape(len(guides.curves), -1, 3)
    before, root = strands_of(kept), points[7, 0].copy()
    points[7] = points[7, :1] + 1.5 * (points[7] - points[7, :1])
    write(guides, points)
    moved = [not np.array_equal(*pair) for pair in zip(strands_of(kept), before, strict=True)]
    apart = np.array([np.linalg.norm(strand[0] - root) for strand in before])
    assert 0 < sum(moved) < 100
    assert apart[moved].mean() < 0.5 * apart.mean()


def test_deleted_and_added_guides_leave_strands_where_they_are(kept):
    before, guides = stored(kept), guides_of(kept)
    guides.remove_curves(indices=[3, 11])
    guides.update_tag()
    update()
    assert np.array_equal(stored(kept), before)
    guides.add_curves([41])
    points = curves.read_points(guides)
    points[-41:] = 1.02 * points[:41]
    write(guides, points)
    assert np.array_equal(stored(kept), before)
    comb(guides, STRETCH)
    assert np.abs(stored(kept) - before).max() > 0.05


def test_strands_that_an_artist_moved_stay_so_and_go_on_following(kept):
    guides = guides_of(kept)
    combed = curves.read_points(guides)
    comb(guides, STRETCH)
    edited = stored(kept)
    own = slice(curves.curve_offsets(kept.data)[9])  # of the first nine
    edited[own] += np.float32(0.04)
    write(kept.data, edited)
    write(guides, combed)
    back = stored(kept)
    comb(guides, STRETCH)
    np.testing.assert_allclose(stored(kept)[own.stop :], edited[own.stop :], atol=2e-5)
    np.testing.assert_allclose(stored(kept)[own], edited[own], atol=5e-3)
    assert np.abs(back - edited).max() > 0.05


def test_simulated_guides_move_strands_and_give_them_back(kept):
    before, guides = stored(kept), guides_of(kept)
    points = curves.read_points(guides).reshape(len(guides.curves), -1, 3)
    swung = points[:, :1] + 1.2 * (points - points[:, :1])
    live_hair.show_guides(guides, swung, bpy.context.evaluated_depsgraph_get())
    assert np.abs(stored(kept) - before).max() > 0.03
    live_hair.show_guides(guides, None, bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(stored(kept), before)


def test_moved_strands_are_carried_by_an_edited_surface_and_find_their_shape_there(kept, sphere):
    guides = guides_of(kept)
    combed, before = curves.read_points(guides), world(kept)
    comb(guides, STRETCH)
    moved = world(kept)
    for vertex in sphere.data.vertices:
        vertex.co.z += 0.25
    sphere.data.update()
    update()
    lift = np.array([0.0, 0.0, 0.25])
    np.testing.assert_allclose(world(kept), moved + lift, atol=1e-4)
    write(guides, combed + lift)
    np.testing.assert_allclose(world(kept), before + lift, atol=1e-4)


def test_undo_brings_strands_back_with_their_guides(kept):
    name, before = kept.name, stored(kept).copy()
    bpy.ops.ed.undo_push(message="before")
    comb(guides_of(kept), STRETCH)
    moved = stored(kept).copy()
    bpy.ops.ed.undo_push(message="combed")
    bpy.ops.ed.undo()
    update()
    assert np.array_equal(stored(bpy.data.objects[name]), before)
    bpy.ops.ed.redo()
    update()
    assert np.array_equal(stored(bpy.data.objects[name]), moved)


def test_a_file_keeps_what_the_strands_were(kept, tmp_path):
    name, before, guides = kept.name, stored(kept).copy(), guides_of(kept)
    combed, guides_name = curves.read_points(guides), guides.name
    comb(guides, STRETCH)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    write(bpy.data.hair_curves[guides_name], combed)
    assert np.array_equal(stored(bpy.data.objects[name]), before)


def test_strands_whose_mesh_was_deleted_say_so(kept, sphere, capfd):
    before = stored(kept)
    bpy.data.objects.remove(sphere)
    comb(guides_of(kept), STRETCH)
    assert kept.data.vellus.status == "The surface is missing: pick a mesh."
    assert np.array_equal(stored(kept), before) and "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("is_overridden", [False, True])
def test_linked_strands_follow_simulated_guides_and_come_back(kept, tmp_path, is_overridden):
    """Linked kept hair follows simulated guides and returns to its shape; the linking file stores none of its data."""
    path = tmp_path / "character.blend"
    bpy.data.libraries.write(str(path), {kept})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        here.objects = list(there.objects)
    for linked in here.objects:
        bpy.context.scene.collection.objects.link(linked)
    if is_overridden:
        here.objects[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    update()
    found = [one for one in bpy.data.hair_curves if one.vellus.kind == "HAIR"]
    hair = next(one for one in found if (one.override_library is not None) == is_overridden)
    before, guides = curves.read_points(hair), hair.vellus.guide_curves
    points = curves.read_points(guides).reshape(len(guides.curves), -1, 3)
    for factor in (1.2, 0.9):
        swung = points[:, :1] + factor * (points - points[:, :1])
        live_hair.show_guides(guides, swung, bpy.context.evaluated_depsgraph_get())
        assert np.abs(curves.read_points(hair) - before).max() > 0.03 and hair.vellus.status == ""
    bindings.kept_cache.clear()
    live_hair.show_guides(guides, None, bpy.context.evaluated_depsgraph_get())
    assert np.array_equal(curves.read_points(hair), before)
