# SPDX-License-Identifier: GPL-3.0-or-later
"""Locks around chosen guides follow edits of the guides and their selection, undo, files and other surfaces."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.strands import attributes, curves, selection_sets
from hair_addon.blender.groom import bindings
from hair_addon.blender.groom.styles import style_notes
from hair_addon.core.interpolation import sharp_edges
from tests.support.commands import load, run_here
from tests.support.overridden import override, parts
from tests.support.reading import points, write_points

STYLE = {"centers": "GUIDES", "levels": 1, "crossover": 0.0, "stray": 0.0}


@pytest.fixture
def locks(hair):
    """Return hair with locks around every fourth guide, which are the saved selection "Some"."""
    save("Some", 4)
    api.add_style(hair.data, "CLUMP", **STYLE, center_guides="Some")
    update()
    return hair


def update():
    bpy.context.view_layer.update()


def save(name, step):
    """Save every so many guides as a selection, by the operator."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    guides = bpy.data.objects["Guides"].data
    attributes.write(guides, ".selection", "BOOLEAN", "CURVE", np.arange(len(guides.curves)) % step == 1)
    assert bpy.ops.vellus.save_selection(name=name) == {"FINISHED"}
    update()


def roots_of(guides):
    return curves.read_points(guides)[curves.curve_offsets(guides)[:-1]]


def require_locks(hair, are_chosen=None):
    """Assert that each strand belongs to the nearest chosen guide, by default to that of the selection "Some"."""
    assert hair.data.vellus.status == ""
    guides = hair.data.vellus.guide_curves
    are_chosen = selection_sets.read_guides(guides, "Some") if are_chosen is None else are_chosen
    roots = roots_of(guides)[are_chosen]
    bound = bindings.of(hair.data)
    styling = bound.styles.styling
    level = styling.levels[0].binding
    centers = bound.surface.to_local(level.positions.numpy()[None])[0]
    np.testing.assert_allclose(centers, roots, atol=1e-4)
    strands = bound.surface.to_local(bound.binding.positions.numpy()[None])[0]
    to_world = bound.surface.to_world_axes
    apart = np.linalg.norm((strands[:, None] - roots) @ to_world.T, axis=-1)
    members = styling.data.members.numpy()[0]
    own = apart[np.arange(len(apart)), members]
    is_nearest = own <= apart.min(axis=1) * (1.0 + 1e-4)
    # Paths around sharp edges of flattened surfaces are longer.
    facing = np.einsum("sc,sc->s", bound.binding.normals.numpy(), level.normals.numpy()[apart.argmin(axis=1)])
    assert np.all(is_nearest | (facing < np.cos(sharp_edges.BEGIN))) and is_nearest.mean() > 0.7
    assert len(np.unique(members)) == are_chosen.sum() > 5


def regenerated(hair):
    """Return the points of hair that is bound again."""
    bindings.invalidate(hair.data)
    hair.data.vellus.is_stale = True
    hair.data.update_tag()
    update()
    return points(hair)


def test_locks_follow_the_selection_and_its_guides(locks):
    """A selection is saved again, and guides are added, removed and moved."""
    require_locks(locks)
    before = points(locks)
    save("Some", 6)
    require_locks(locks)
    assert np.abs(points(locks) - before).max() > 0.01
    np.testing.assert_array_equal(points(locks), regenerated(locks))
    guides = bpy.data.objects["Guides"].data
    guides.remove_curves(indices=[0, 1, 12, 20])
    update()
    require_locks(locks)
    api.change_guides(guides, "LENGTH", method="MAXIMUM", length=0.2)
    update()
    require_locks(locks)
    np.testing.assert_allclose(points(locks), regenerated(locks), atol=1e-6)
    locks.data.vellus.styles[0].clump.center_guides = ""
    update()
    require_locks(locks, np.ones(len(guides.curves), bool))


@pytest.mark.parametrize("is_layered", [False, True])
def test_locks_stay_in_place_when_guides_are_generated_again(locks, is_layered):
    """Each center goes to the nearest new guide, with more, fewer and other guides; other selections to all guides."""
    guides = bpy.data.objects["Guides"].data
    save("Some", 9)
    half = curves.read_points(guides)[:, 0] > 0.0
    selection_sets.write(
        guides, "Half", np.repeat(half[curves.curve_offsets(guides)[:-1]], curves.point_counts(guides))
    )
    if is_layered:
        api.add_layer(guides)
    for setting, value in (("guide_count", 240), ("seed", 9), ("guide_count", 120)):
        before = roots_of(guides)[selection_sets.read_guides(guides, "Some")]
        setattr(guides.vellus.guides, setting, value)
        update()
        roots, are_chosen = roots_of(guides), selection_sets.read_guides(guides, "Some")
        apart = np.linalg.norm(roots[:, None] - before, axis=2)
        np.testing.assert_array_equal(np.unique(apart.argmin(axis=0)), np.flatnonzero(are_chosen))
        require_locks(locks)
        is_right = selection_sets.read_guides(guides, "Half") == (roots[:, 0] > 0.0)
        assert is_right[np.abs(roots[:, 0]) > 0.4].all() and is_right.mean() > 0.85


def test_a_missing_selection_is_a_status(locks):
    before = points(locks)
    bpy.ops.vellus.remove_selection(name="Some")
    update()
    sentence = 'The guides have no selection "Some" for the centers of locks: pick another.'
    assert locks.data.vellus.status == sentence
    item = locks.data.vellus.styles[0]
    assert style_notes.notes_of(locks.data, item) == ['No selection "Some": pick another.']
    np.testing.assert_array_equal(points(locks), before)
    guides = bpy.data.objects["Guides"].data
    selection_sets.write(guides, "Some", np.zeros(len(guides.points), bool))
    regenerated(locks)
    assert locks.data.vellus.status == 'The selection "Some" for the centers of locks has no guides: pick another.'
    save("Some", 4)
    require_locks(locks)
    np.testing.assert_array_equal(points(locks), before)


def test_a_saved_selection_leaves_edited_strands_alone(locks):
    write_points(locks, 1.1 * points(locks))
    update()
    assert curves.is_combed(locks.data)
    before, status = points(locks), locks.data.vellus.status
    save("Some", 6)
    np.testing.assert_array_equal(points(locks), before)
    assert locks.data.vellus.status == status


def test_undo_and_redo(locks):
    bpy.ops.ed.undo_push(message="before")
    found = [points(locks)]
    save("Some", 7)
    found.append(points(locks))
    bpy.ops.ed.undo_push(message="saved")
    for step, expected in ((bpy.ops.ed.undo, found[0]), (bpy.ops.ed.redo, found[1])):
        step()
        update()
        hair = bpy.data.objects["Hair"]
        np.testing.assert_array_equal(points(hair), expected)
        np.testing.assert_array_equal(regenerated(hair), expected)
        require_locks(hair)


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (100.0, 100.0, 100.0), (-1.0, 2.0, 0.5)], ids=str)
def test_scaled_and_mirrored_surfaces(locks, scale):
    bpy.data.objects["Sphere"].matrix_world = (
        Matrix.Translation((1.0, 2.0, 3.0)) @ Matrix.Rotation(0.8, 4, (1.0, 0.3, 0.2)) @ Matrix.Diagonal((*scale, 1.0))
    )
    update()
    regenerated(locks)
    require_locks(locks)


def test_overridden_and_transferred_hair(locks, tmp_path):
    before = points(locks)
    override(locks, tmp_path)
    sphere, _guides, hair = parts()
    sphere.location.x = 2.0
    update()
    np.testing.assert_allclose(api.points(hair.data), before + np.float32([2.0, 0.0, 0.0]), atol=1e-6)
    sphere.location.x = 0.0
    copy = bpy.data.objects.new("Copy", sphere.data.copy())
    bpy.context.scene.collection.objects.link(copy)
    copy.location.x = 3.0
    update()
    made = api.transfer_groom(hair.data, copy, method="UV").hair
    update()
    require_locks(next(o for o in bpy.data.objects if o.data == made))


def test_a_library_groom_has_locks_around_all_guides(locks, tmp_path):
    """Selections are not part of a saved groom; the groom names the one that is left out."""
    picture = np.zeros((4, 4, 4), np.float32)
    file = api.save_groom(locks.data, tmp_path, name="Locks", catalog="", picture=picture)
    guides, made = api.apply_groom(bpy.data.objects["Sphere"], file)
    update()
    assert made.vellus.styles[0].clump.center_guides == ""
    hair = next(o for o in bpy.data.objects if o.data == made)
    require_locks(hair, np.ones(len(guides.curves), bool))


def test_command_line(sphere, tmp_path):
    path, out = tmp_path / "sphere.blend", tmp_path / "out.npz"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    words = ("groom", path, "--guides", 40, "--strands", 300, "--out", out, "--style")
    grown = []
    for style in ("clump:centers=GUIDES,levels=1", "clump:levels=1"):
        ended = run_here(*words, style)
        assert (ended.status, ended.errors) == (0, "")
        grown.append(load(out)["strand_points"])
    assert np.abs(grown[0] - grown[1]).max() > 0.01
    ended = run_here(*words, "clump:centers=GUIDES,center_guides=None here")
    assert ended.status != 0 and 'no selection "None here"' in ended.errors
