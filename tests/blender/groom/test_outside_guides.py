# SPDX-License-Identifier: GPL-3.0-or-later
"""Combed guides stay outside of their surface as it is posed, with their roots and lengths."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.strands import frozen_points
from hair_addon.blender.groom.guides import outside_guides
from hair_addon.core.dynamics.outside import Barrier
from tests.support.reading import evaluated_points, points, write_points


@pytest.fixture
def guides(hair):
    """Return guides in Sculpt Mode."""
    found = bpy.data.objects["Guides"]
    enter(found)
    yield found
    if found.name in bpy.data.objects:
        bpy.ops.object.mode_set(mode="OBJECT")


def enter(found, mode="SCULPT_CURVES"):
    bpy.context.view_layer.objects.active = found
    bpy.ops.object.mode_set(mode=mode)
    bpy.context.view_layer.update()


def inward(shape):
    """Bend guides into the sphere and keep the lengths of segments."""
    steps = np.diff(shape.astype(np.float64), axis=1)
    lengths = np.linalg.norm(steps, axis=2, keepdims=True)
    steps = steps / lengths - 3.0 * np.linspace(0.0, 1.0, steps.shape[1])[None, :, None] * shape[:, :1]
    steps *= lengths / np.linalg.norm(steps, axis=2, keepdims=True)
    return np.concatenate([shape[:, :1], shape[:, :1] + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)


def comb(found, wanted):
    """Write the points of one event of a stroke, which Blender's next update reports."""
    write_points(found, wanted)
    found.data.update_tag()
    bpy.context.view_layer.update()
    return points(found)


def segments(shape):
    return np.linalg.norm(np.diff(shape.astype(np.float64), axis=1), axis=2)


def depths(shape, radius=1.0):
    """Return how far points (G, P, 3) other than roots are inside of the sphere, whose faces are flat."""
    return 0.993 * radius - np.linalg.norm(shape[:, 1:], axis=2)


@pytest.mark.parametrize("has_layer", [False, True])
def test_a_stroke_leaves_no_point_inside(guides, has_layer):
    if has_layer:
        api.add_layer(guides)
    before, wanted = points(guides), inward(points(guides))
    assert depths(wanted).max() > 0.1
    after = comb(guides, wanted)
    assert depths(after).max() < 1e-6
    assert np.array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(segments(after), segments(wanted), rtol=1e-4)
    assert np.abs(after - before).max() > 0.1
    if has_layer:
        guides.data.vellus.layers[0].weight = 0.0
        bpy.context.view_layer.update()
        np.testing.assert_allclose(points(guides), before, atol=1e-6)


def test_only_guides_that_a_stroke_moves_are_pushed(guides):
    guides.data.vellus.keeps_outside = False
    inside = comb(guides, inward(points(guides)))
    assert depths(inside).max() > 0.1
    guides.data.vellus.keeps_outside = True
    wanted = inside.copy()
    wanted[7, 1:, 0] += 0.01
    after = comb(guides, wanted)
    assert depths(after[7:8]).max() < 1e-6
    others = np.arange(len(after)) != 7
    assert np.array_equal(after[others], inside[others])


def test_frozen_points_stay(guides):
    """Frozen points stay, also slightly inside the surface, while the rest of the guide is moved outside."""
    state = guides.data.vellus
    state.keeps_outside = False
    inside = comb(guides, inward(points(guides)))
    is_crossing = (depths(inside) > 0.0).any(axis=1)
    ends = np.where(is_crossing, 2 + np.argmax(depths(inside) > 0.0, axis=1), 3)  # the first frozen point inside
    frozen = np.arange(inside.shape[1]) < ends[:, None]
    frozen_points.write(guides.data, frozen.ravel())
    bpy.context.view_layer.update()
    state.keeps_outside = True
    wanted = inside.copy()
    wanted[:, 1:, 2] += 0.003
    after = comb(guides, wanted)
    assert is_crossing.sum() > 10 and np.array_equal(after[frozen], inside[frozen])
    free = ~frozen[:, 1:]
    assert depths(after)[free].max() < 1e-6
    is_joint = (
        np.arange(1, inside.shape[1]) == ends[:, None]
    )  # the brush stretches these, which begin at a frozen point
    np.testing.assert_allclose(segments(after)[free & ~is_joint], segments(wanted)[free & ~is_joint], rtol=1e-4)
    assert segments(after)[is_joint].max() < 1.3 * segments(wanted).max()


@pytest.mark.parametrize("change", ["small", "large", "uneven", "mirrored", "turned and parented", "open"])
def test_transformed_surfaces_keep_guides_outside(guides, change):
    """In the coordinates of the sphere, guides have the same shape with and without a transform."""
    sphere, alone = bpy.data.objects["Sphere"], points(guides)
    if change == "open":
        bpy.ops.object.mode_set(mode="OBJECT")
        low = np.flatnonzero(np.array([v.co.z for v in sphere.data.vertices]) < -0.9)
        mesh = bmesh.new()
        mesh.from_mesh(sphere.data)
        mesh.verts.ensure_lookup_table()
        bmesh.ops.delete(mesh, geom=[mesh.verts[i] for i in low], context="VERTS")
        mesh.to_mesh(sphere.data)
        bpy.context.view_layer.update()
        enter(guides)
        alone = points(guides)
    elif change == "turned and parented":
        parent = bpy.data.objects.new("Parent", None)
        bpy.context.scene.collection.objects.link(parent)
        parent.matrix_world = Matrix.Translation((3.0, 2.0, 1.0)) @ Matrix.Rotation(1.0, 4, "X")
        sphere.parent = parent
    else:
        scale = {"small": [0.01] * 3, "large": [100.0] * 3, "uneven": [1.0, 2.0, 0.5], "mirrored": [-1.0, 1.0, 1.0]}
        sphere.scale = scale[change]
    bpy.context.view_layer.update()
    wanted = inward(alone)
    after = comb(guides, wanted)
    sides = depths(after) if change != "open" else depths(after)[alone[:, 0, 2] > -0.3]
    assert sides.max() < 1e-5
    scale = np.abs(np.array(sphere.matrix_world.to_3x3())) if change == "uneven" else np.eye(3)
    np.testing.assert_allclose(segments(after @ scale.T), segments(wanted @ scale.T), rtol=1e-3)


def test_guides_stay_outside_of_the_posed_surface(guides):
    """Guides stay outside of a sphere that a shape key enlarges and twists, at rest and in the visible pose."""
    sphere, before = bpy.data.objects["Sphere"], points(guides)
    sphere.shape_key_add(name="Basis")
    key = sphere.shape_key_add(name="Large")
    for point in key.data:
        point.co = Matrix.Rotation(0.4 * point.co.z, 3, "Z") @ (1.5 * point.co)
    for value, radius in ((0.0, 1.0), (1.0, 1.5)):
        key.value = value
        bpy.context.view_layer.update()
        after = comb(guides, inward(before))
        assert depths(evaluated_points(guides), radius).max() < 3e-3
        assert np.array_equal(after[:, 0], before[:, 0])


def test_push_outside_moves_guides_that_are_inside(guides):
    bpy.ops.object.mode_set(mode="OBJECT")
    before = points(guides)
    wanted = inward(before)
    wanted[::2] = before[::2]
    comb(guides, wanted)
    assert depths(points(guides)).max() > 0.1  # as no artist combs in this mode
    assert bpy.ops.vellus.push_outside() == {"FINISHED"}
    after = points(guides)
    assert depths(after).max() < 1e-6 and np.array_equal(after[::2], before[::2])
    np.testing.assert_allclose(segments(after), segments(wanted), rtol=1e-4)
    assert api.change_guides(guides, "OUTSIDE") == 0
    assert api.change_guides(guides, "OUTSIDE", clearance=0.05) == len(after)
    low = np.linalg.norm(points(guides), axis=2)[:, 5:]
    assert low.min() > 1.04


@pytest.mark.parametrize("has_layer", [False, True])
def test_new_guides_stay_outside(sphere, has_layer):
    """New guides between few guides that lie around a ball do not pass through it; without the push, by half of it."""
    bpy.ops.vellus.distribute_guides(guide_count=6)
    guides = bpy.data.objects["Guides"]
    shape = points(guides)
    turns = np.linspace(0.0, 1.5, shape.shape[1])[None, :, None]
    across = np.cross(shape[:, 0], [0.0, 0.0, 1.0])
    around = np.cross(shape[:, 0], across / np.linalg.norm(across, axis=1, keepdims=True))
    lying = 1.01 * (np.cos(turns) * shape[:, :1] + np.sin(turns) * around[:, None])
    lying[:, 0] = shape[:, 0]
    write_points(guides, lying.astype(np.float32))
    bpy.context.view_layer.update()
    if has_layer:
        api.add_layer(guides)
    before = points(guides)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.change_guide_count(factor=5.0)
    bpy.context.view_layer.update()
    after = points(guides)
    assert len(after) == 30 and np.array_equal(after[:6], before)
    assert depths(after[6:]).max() < 1e-4


def test_undone_guides_are_not_pushed(guides):
    guides.data.vellus.keeps_outside = False
    bpy.ops.ed.undo_push(message="off")
    comb(guides, inward(points(guides)))
    inside = points(guides)
    bpy.ops.ed.undo_push(message="combed")
    guides.data.vellus.keeps_outside = True
    bpy.ops.ed.undo_push(message="on")
    bpy.ops.ed.undo()
    found = bpy.data.objects["Guides"]
    bpy.context.view_layer.update()
    assert np.array_equal(points(found), inside)


def test_undo_and_redo_in_edit_mode_restore_what_was_shown(guides):
    """Blender's steps of Edit Mode hold guides before they are pushed outside, and before frozen points return."""
    found, hair = guides, bpy.data.objects["Hair"]
    frozen_points.write(found.data, np.tile(np.arange(41) < 5, 60))
    bpy.ops.object.mode_set(mode="OBJECT")
    enter(found, "EDIT")
    bpy.ops.curves.select_all("EXEC_DEFAULT", True, action="SELECT")
    shown = []
    for factor in (0.9, 0.8, 0.9):
        bpy.ops.transform.resize("EXEC_DEFAULT", True, value=(factor,) * 3)
        bpy.context.view_layer.update()
        shown.append((points(found), points(hair)))
    assert all(np.array_equal(each[:, :5], shown[0][0][:, :5]) for each, _strands in shown)
    for step, expected in ((bpy.ops.ed.undo, shown[1]), (bpy.ops.ed.undo, shown[0]), (bpy.ops.ed.redo, shown[1])):
        step()
        bpy.context.view_layer.update()
        for name, wanted in zip(("Guides", "Hair"), expected, strict=True):
            np.testing.assert_array_equal(points(bpy.data.objects[name]), wanted)


def test_a_stroke_reads_only_the_guides_that_it_moves(guides, monkeypatch):
    """At rest, an event of a stroke transforms the points of combed guides alone, however many guides there are."""
    before = comb(guides, points(guides) * np.float32(1.001))  # prepares the surface
    wanted = before.copy()
    wanted[7] = inward(before)[7]
    counts, real = [], Barrier.moved_local

    def counted(barrier, shape, *given):
        counts.append(shape.size // 3)
        return real(barrier, shape, *given)

    monkeypatch.setattr(Barrier, "moved_local", counted)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    after = outside_guides.pushed_out(guides.data, before.reshape(-1, 3), wanted.reshape(-1, 3), depsgraph)
    is_moved = (after.reshape(before.shape) != before).any(axis=(1, 2))
    assert np.flatnonzero(is_moved).tolist() == [7] and depths(after.reshape(before.shape))[7].max() < 1e-6
    assert counts == [before.shape[1]]
