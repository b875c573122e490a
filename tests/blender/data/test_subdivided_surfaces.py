# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on subdivided surfaces: neighboring strands stay together at every level."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data import scene
from hair_addon.core.geometry import closest_point
from hair_addon.core.geometry.mesh import positions
from tests.support.dynamics.following import assert_follows, drawn_points, grow, update
from tests.support.pictures import render_probe
from tests.support.reading import evaluated_points, points, vertex_positions, write_points


@pytest.fixture
def cube(scene):
    """Return a cube of 2 m, subdivided twice by a modifier, as an example of a strongly bent cage."""
    bpy.ops.mesh.primitive_cube_add()
    subdivision = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 2, 3
    update()
    return bpy.context.object


def grow_straight(surface):
    """Return guides and hair that all have the same direction at rest."""
    guides, hair = grow(surface, guide_count=80, strand_count=400, gravity=0.0, tilt=0.0, length_variation=0.0)
    combed = points(guides)
    write_points(guides, combed[:, :1] + np.linspace(0.0, 0.3, combed.shape[1])[:, None] * np.float32([0.6, 0.0, 0.8]))
    return guides, hair


def turns(before, after):
    """Return (S,) angles [rad] by which strands turned, from root to tip."""
    arms = [np.diff(p[:, [0, -1]], axis=1)[:, 0] for p in (before, after)]
    units = [arm / np.linalg.norm(arm, axis=1, keepdims=True) for arm in arms]
    return np.arccos(np.clip((units[0] * units[1]).sum(axis=1), -1.0, 1.0))


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_subdivision_does_not_turn_strands(cube, levels):
    """Strands of a cube turn by at most a fifth of the angle between cage and smooth surface, which is 45° at edges."""
    cube.modifiers[0].levels = levels
    update()
    for curves_object in grow_straight(cube):
        assert turns(points(curves_object), evaluated_points(curves_object)).max() < np.radians(12.0)


def test_new_guides_stand_on_the_smooth_surface(cube):
    guides, _hair = grow(cube, gravity=0.0, tilt=0.0)
    found = evaluated_points(guides)
    outward = found[:, 0] / np.linalg.norm(found[:, 0], axis=1, keepdims=True)  # a cube becomes nearly a ball
    assert turns(np.stack([np.zeros_like(outward), outward], axis=1), found).max() < np.radians(15.0)


def test_a_simple_subdivision_leaves_strands_in_place(cube):
    cube.modifiers[0].subdivision_type = "SIMPLE"
    update()
    for curves_object in grow_straight(cube):
        np.testing.assert_allclose(evaluated_points(curves_object), points(curves_object), atol=1e-6)


def test_nodes_and_pictures_agree_while_it_deforms(cube):
    grown = grow_straight(cube)
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Key")
    stood = vertex_positions(cube)
    key.data.foreach_set("co", (stood + 0.4 * stood[:, [2, 0, 1]] * [1.0, 0.0, 0.5]).astype(np.float32).ravel())
    key.value = 1.0
    update()
    assert_follows(*grown)


def test_a_rigid_motion_of_the_cage_moves_hair_rigidly(cube):
    grown = grow_straight(cube)
    before = [evaluated_points(curves_object) for curves_object in grown]
    turn = np.array(Matrix.Rotation(2.0, 3, (1.0, -2.0, 0.5)))
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Key")
    key.data.foreach_set("co", (vertex_positions(cube) @ turn.T + 1.0).astype(np.float32).ravel())
    key.value = 1.0
    update()
    for curves_object, stood in zip(grown, before, strict=True):
        np.testing.assert_allclose(evaluated_points(curves_object), stood @ turn.T + 1.0, atol=2e-5)


def test_a_finer_subdivision_turns_no_strands_either(cube):
    """As in renders, hair stays rooted on the viewport's mesh, although estimates of the smooth surface differ by
    level.
    """
    guides, hair = grow_straight(cube)
    guides.data.vellus.is_live = hair.data.vellus.is_live = False
    before = evaluated_points(hair)
    cube.modifiers[0].levels = 3
    update()
    after = evaluated_points(hair)
    assert np.abs(after[:, 0] - before[:, 0]).max() > 1e-4  # another mesh
    assert turns(before, after).max() < np.radians(8.0)


def test_smooth_positions_are_computed_once(cube, monkeypatch):
    grow_straight(cube)
    first, second = (scene.read_surface(cube, bpy.context.evaluated_depsgraph_get()) for _ in range(2))
    assert first.smooth_rest is second.smooth_rest and first.is_same(second)
    drawn_points(bpy.data.objects["Hair"])


def set_levels(surface, levels):
    surface.modifiers[0].levels = levels


def set_simplify(surface, levels):
    surface.modifiers[0].levels = 2
    render = bpy.context.scene.render
    render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = levels == 0, 0, 6


def set_eye(surface, levels):
    surface.modifiers[0].show_viewport = levels > 0


@pytest.fixture
def rendered(cube):
    """Return a function that renders, and returns the strands and the largest distance of a root from the surface."""
    with render_probe.probing() as render:
        yield lambda: render("Hair", cube.name)


def bulge(cube):
    """Bend the cage's faces and deform them, so that levels have different positions."""
    for vertex in cube.data.vertices[:3]:
        vertex.co *= 1.3
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Key")
    key.data[0].co.z += 0.4
    key.value = 1.0
    update()


@pytest.mark.parametrize("kind", ["SUBSURF", "MULTIRES"])
def test_renders_do_not_depend_on_the_levels_of_viewports(cube, rendered, kind):
    """Neither stored nor recomputed data of hair depend on the viewport's levels."""
    if kind == "MULTIRES":
        cube.modifiers.clear()
        cube.modifiers.new("Multires", "MULTIRES")
        for _ in range(3):
            bpy.ops.object.multires_subdivide(modifier="Multires")
        cube.modifiers[0].levels = cube.modifiers[0].render_levels = 2
    bulge(cube)
    guides, hair = grow(cube, guide_count=40, strand_count=200)
    stood, combed = points(hair), points(guides)
    before = {}
    for render_levels in (0, 1, 2, 3):
        cube.modifiers[0].render_levels = render_levels
        before[render_levels], apart = rendered()
        assert apart < 2e-6
    for change in (set_levels, set_eye, set_simplify):
        for levels in (0, 1, 2, 3):
            change(cube, levels)
            update()
            cube.modifiers[0].render_levels = 3 - levels
            np.testing.assert_array_equal(points(hair), stood)
            np.testing.assert_array_equal(points(guides), combed)
            np.testing.assert_array_equal(rendered()[0], before[3 - levels])
            shown = evaluated_points(hair)[:, 0]
            there = evaluated_mesh(cube)
            nearest = closest_point.SurfaceQuery(there).nearest(shown)
            assert np.linalg.norm(positions(there, nearest) - shown, axis=1).max() < 2e-6
            np.testing.assert_allclose(drawn_points(hair), evaluated_points(hair), atol=1e-5)
            assert guides.data.vellus.status == hair.data.vellus.status == ""
    set_levels(cube, 0)
    update()
    write_points(guides, combed + np.linspace(0.0, 0.1, combed.shape[1])[:, None] * np.float32([0.6, 0.0, 0.8]))
    at_none = points(hair)
    set_levels(cube, 2)
    update()
    write_points(guides, combed)
    np.testing.assert_allclose(points(hair), stood, atol=1e-6)
    write_points(guides, combed + np.linspace(0.0, 0.1, combed.shape[1])[:, None] * np.float32([0.6, 0.0, 0.8]))
    np.testing.assert_allclose(points(hair), at_none, atol=1e-6)


def evaluated_mesh(surface):
    evaluated = surface.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found = render_probe.read_mesh(evaluated.to_mesh())
    evaluated.to_mesh_clear()
    return found


def test_strands_follow_what_is_moved_at_another_level(cube):
    """Hair keeps its place on the faces if the cage is edited while the modifier is disabled."""
    guides, hair = grow(cube, guide_count=40, strand_count=200)
    before = points(hair)[:, 0]
    set_eye(cube, 0)
    update()
    for vertex in cube.data.vertices:
        vertex.co.x += 0.5 if vertex.co.x > 0.0 else 0.0
    cube.data.update()
    update()
    set_eye(cube, 2)
    update()
    moved = before.copy()
    moved[:, 0] += 0.25 * (1.0 + before[:, 0])  # all faces stretch
    np.testing.assert_allclose(points(hair)[:, 0], moved, atol=1e-5)
    assert guides.data.vellus.status == ""


def test_an_applied_subdivision_leaves_strands_where_they_were_seen(cube):
    guides, _hair = grow_straight(cube)
    seen = evaluated_points(guides)
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.modifier_apply(modifier="Subdivision")
    update()
    np.testing.assert_allclose(points(guides)[:, 0], seen[:, 0], atol=1e-5)
    assert guides.data.vellus.status == ""
