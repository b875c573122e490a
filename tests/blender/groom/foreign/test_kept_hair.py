# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of any origin become hair with the same bits, and guides that reproduce it."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import pipeline
from hair_addon.blender.render import read_strands
from hair_addon.core.errors import HairError
from tests.support.commands import run_here
from tests.support.dynamics.following import update
from tests.support.exchange.imported import curves_object, lines_on, select, stored, world

COUNT, GUIDES = 300, 40


def use(*chosen, **options):
    select(*chosen)
    return bpy.ops.vellus.use_as_hair(**{"guide_count": GUIDES, **options})


@pytest.fixture
def strands(sphere, rng):
    """Return polylines that start on the sphere, of 5 to 12 points each."""
    return curves_object(list(lines_on(sphere, rng, COUNT, least=5)))


@pytest.fixture
def kept(sphere, strands):
    """Return the polylines used as hair."""
    use(sphere, strands)
    return strands


def regenerate(hair_object):
    """Regenerate strands with the hair's own settings, as in a window."""
    pipeline.interpolate_hair(*pipeline.inputs_of(hair_object.data), scene.present_depsgraph(), hair_object.data)


def guides_of(hair_object):
    return hair_object.data.vellus.guide_curves


def lengths_of(hair_object):
    points = stored(hair_object)
    return [
        np.linalg.norm(np.diff(part, axis=0), axis=1).sum()
        for part in np.split(points, curves.curve_offsets(hair_object.data)[1:-1])
    ]


@pytest.mark.parametrize("kind", ["POLY", "CATMULL_ROM"])
def test_no_bit_of_any_point_changes(sphere, rng, kind):
    lines = list(lines_on(sphere, rng, COUNT, least=5))
    hair = curves_object(lines, kind=kind)
    before, seen = stored(hair).copy(), world(hair)
    assert use(sphere, hair) == {"FINISHED"}
    update()
    assert np.array_equal(stored(hair), before)
    assert np.array_equal(world(hair), seen)
    assert (hair.parent, hair.data.vellus.kind, hair.visible_camera) == (sphere, "HAIR", True)
    assert len(guides_of(hair).curves) == GUIDES
    assert not guides_of(hair).users == 0


def test_guides_are_where_strands_are_and_keep_their_roots_on_the_surface(kept, sphere):
    firsts = curves.first_points(kept.data)
    roots = curves.first_points(guides_of(kept))
    apart = np.linalg.norm(firsts[:, None] - roots[None], axis=2).min(axis=0)
    assert apart.max() < 5e-3  # the ball is of flat faces, above which strands begin


def test_nothing_regenerates_hair_that_is_kept(kept, sphere):
    before = stored(kept).copy()
    kept.data.vellus.hair.strand_count = 77
    update()
    assert np.array_equal(stored(kept), before)
    assert kept.data.vellus.status.startswith("Kept unchanged")


def test_regenerated_strands_stand_on_the_same_roots_and_follow_the_guides(kept):
    firsts, count, lengths = curves.first_points(kept.data), len(kept.data.curves), lengths_of(kept)
    regenerate(kept)
    assert len(kept.data.curves) == count
    np.testing.assert_allclose(curves.first_points(kept.data), firsts, atol=5e-3)
    np.testing.assert_allclose(lengths_of(kept), lengths, rtol=0.1)
    guides = guides_of(kept)
    before = stored(kept).copy()
    guides.attributes["position"].data.foreach_set("vector", (1.1 * curves.read_points(guides)).ravel())
    guides.update_tag()
    update()
    assert not np.array_equal(stored(kept), before)


def test_follow_guides_is_the_same_as_regenerating_later(sphere, strands):
    use(sphere, strands, follows_guides=True)
    at_once = stored(strands).copy()
    again = curves_object(list(lines_on(sphere, np.random.Generator(np.random.PCG64(20260101)), COUNT, least=5)))
    use(sphere, again)
    regenerate(again)
    np.testing.assert_allclose(stored(again), at_once, atol=1e-6)


def test_undo_takes_all_of_it_back(sphere, strands):
    name, before = strands.name, stored(strands).copy()
    bpy.ops.ed.undo_push(message="before")
    use(sphere, strands)
    bpy.ops.ed.undo_push(message="used")
    bpy.ops.ed.undo()
    shown = bpy.data.objects[name]
    assert (shown.data.vellus.kind, shown.parent) == ("NONE", None)
    assert np.array_equal(stored(shown), before)
    assert not [c for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES"]
    bpy.ops.ed.redo()
    shown = bpy.data.objects[name]
    assert shown.data.vellus.kind == "HAIR"
    assert np.array_equal(stored(shown), before)


def test_kept_hair_moves_with_its_surface_when_that_is_edited(kept, sphere):
    before = world(kept)
    for vertex in sphere.data.vertices:
        vertex.co.z += 0.25
    sphere.data.update()
    update()
    np.testing.assert_allclose(world(kept), before + np.array([0.0, 0.0, 0.25]), atol=1e-5)


def test_kept_hair_moves_once_when_the_surface_is_scaled_for_good(kept, sphere):
    sphere.scale = (2.0, 2.0, 2.0)
    update()
    before = world(kept)
    select(sphere)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    update()
    np.testing.assert_allclose(world(kept), before, atol=1e-4)


def test_strands_of_any_point_counts_are_drawn_with_their_radii(sphere, rng):
    hair = curves_object(list(lines_on(sphere, rng, 20, least=3)))
    starts = curves.curve_offsets(hair.data)
    radii = np.concatenate([np.linspace(0.002, 0.001, count) for count in np.diff(starts)]).astype(np.float32)
    hair.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    use(sphere, hair)
    read = read_strands.read(hair.data)
    points, drawn = read.points, read.radii
    assert points.shape[1] == np.diff(starts).max()
    np.testing.assert_allclose(drawn[:, 0], 0.002, rtol=1e-6)
    np.testing.assert_allclose(drawn[:, -1], 0.001, rtol=1e-6)
    assert (np.diff(drawn, axis=1) < 0.0).all()


def test_splines_are_drawn_round(sphere):
    """A half circle of four control points is drawn as a spline, not as three lines at 60°."""
    angles = np.linspace(0.0, np.pi, 4)
    arc = np.stack([0.2 * np.sin(angles), np.zeros(4), 1.0 + 0.2 * (1.0 - np.cos(angles))], axis=1)
    hair = curves_object([arc, arc + np.array([0.0, 0.1, 0.0])], kind="CATMULL_ROM")
    use(sphere, hair, guide_count=1)
    points = read_strands.read(hair.data).points
    turns = np.diff(points[0], axis=0)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    assert np.sum(turns[1:] * turns[:-1], axis=1).min() > np.cos(np.radians(25.0))


@pytest.fixture
def particles(sphere):
    """Return the sphere with a particle system of 40 hairs."""
    select(sphere)
    bpy.ops.object.particle_system_add()
    settings = sphere.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 40, 0.3
    update()
    return sphere


@pytest.mark.parametrize("use_as", ["HAIR", "GUIDES"])
def test_particle_hair_is_converted_in_one_step(particles, use_as):
    select(particles)
    bpy.ops.curves.convert_from_particle_system()
    expected = world(bpy.context.object)
    bpy.data.objects.remove(bpy.context.object)
    update()
    select(particles)
    assert bpy.ops.vellus.convert_particles(use=use_as, guide_count=12) == {"FINISHED"}
    hair = bpy.context.object
    kept = hair if use_as == "HAIR" else next(o for o in bpy.data.objects if o.data == guides_of(hair))
    np.testing.assert_allclose(world(kept), expected, atol=1e-6)
    assert (hair.data.vellus.kind, len(guides_of(hair).curves)) == ("HAIR", 12 if use_as == "HAIR" else 40)
    assert not (particles.modifiers[0].show_viewport or particles.modifiers[0].show_render)


@pytest.mark.parametrize("use_as", ["HAIR", "GUIDES"])
def test_scripts_and_the_command_line_convert_particle_hair(particles, tmp_path, use_as):
    """The points are those of Blender's conversion, and the system is switched off."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "head.blend"))
    if use_as == "GUIDES":
        with pytest.raises(HairError, match="The guide count has no effect"):
            api.convert_particles(particles, use_as, guide_count=12)
    made = api.convert_particles(particles, use_as, **({"guide_count": 12} if use_as == "HAIR" else {}))
    kept = made.hair if use_as == "HAIR" else made.guides
    expected = world(next(one for one in bpy.data.objects if one.data == kept))
    assert not particles.modifiers[0].show_render and len(made.guides.curves) == (12 if use_as == "HAIR" else 40)
    with pytest.raises(HairError, match="hidden"):
        api.convert_particles(particles)
    words = "groom", tmp_path / "head.blend", "--from-particles", use_as, "--guides", "12", "--out"
    done = run_here(*words, tmp_path / "out.blend")
    assert done.status == 0 and ("--guides has no effect" in done.errors) == (use_as == "GUIDES")
    assert run_here(*words, tmp_path / "b.blend", "--from-mesh", "Cards").status == 1
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    (kept,) = [one for one in bpy.data.objects if one.type == "CURVES" and one.data.vellus.kind == use_as]
    np.testing.assert_allclose(world(kept), expected, atol=1e-6)
    assert not bpy.data.objects["Sphere"].modifiers[0].show_render


@pytest.mark.parametrize("children", ["SIMPLE", "INTERPOLATED"])
def test_of_particle_hair_with_children_the_parents_are_converted(particles, children):
    settings = particles.particle_systems[0].settings
    settings.child_type = children
    update()
    select(particles)
    system = particles.evaluated_get(bpy.context.evaluated_depsgraph_get()).particle_systems[0]
    parents = np.array([[particle.hair_keys[end].co for end in (0, -1)] for particle in system.particles], np.float32)
    assert bpy.ops.vellus.convert_particles(use="HAIR", guide_count=12) == {"FINISHED"}
    strands = stored(bpy.context.object).reshape(40, -1, 3)
    np.testing.assert_allclose(strands[:, [0, -1]], parents, atol=1e-5)
    assert settings.child_type == children


def test_particle_hair_that_cannot_be_converted_leaves_nothing_behind(particles):
    particles.particle_systems[0].settings.count = 0
    update()
    before = len(bpy.data.objects), len(bpy.data.hair_curves)
    select(particles)
    with pytest.raises(RuntimeError, match=r"particle system .* has no hair yet"):
        bpy.ops.vellus.convert_particles()
    assert (len(bpy.data.objects), len(bpy.data.hair_curves)) == before
    assert particles.modifiers[0].show_viewport


@pytest.mark.parametrize("ending", [".usdc", ".abc"])
def test_strands_of_a_file_stay_where_it_has_them(sphere, rng, tmp_path, ending):
    lines = list(lines_on(sphere, rng, COUNT, least=5))
    made, path = curves_object(lines, "Strands"), str(tmp_path / f"strands{ending}")
    if ending == ".abc":
        bpy.ops.wm.alembic_export(filepath=path, as_background_job=False)
    else:
        bpy.ops.wm.usd_export(filepath=path)
    bpy.data.objects.remove(made)
    before = set(bpy.data.objects)
    (bpy.ops.wm.alembic_import if ending == ".abc" else bpy.ops.wm.usd_import)(filepath=path)
    update()
    for other in set(bpy.data.objects) - before:
        if other.type == "MESH":
            bpy.data.objects.remove(other)
    update()
    hair = next(o for o in bpy.data.objects if o.type == "CURVES")
    seen = world(hair)
    np.testing.assert_allclose(seen, np.concatenate(lines), atol=1e-5)
    use(sphere, hair)
    update()
    np.testing.assert_allclose(world(hair), seen, atol=1e-6)
    assert len(guides_of(hair).curves) == GUIDES
