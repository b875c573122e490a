# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide tools work on scaled, rotated or deformed surfaces and on curves of any type, or refuse with a message."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom.guides import guide_tools
from tests.support.dynamics.following import assert_follows, update
from tests.support.guide_tools import (
    CHOSEN,
    SHAPING,
    TOOLS,
    grown_from_nothing,
    lengths_of,
    said_by,
    select_guides,
    use_tool,
)
from tests.support.pairs import share_of
from tests.support.reading import attribute, points, snapshot


@pytest.fixture
def turned(waved):
    """Return the hair on a turned, moved object of twice the size."""
    surface = bpy.data.objects["Sphere"]
    surface.location, surface.rotation_euler, surface.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    cutter = bpy.data.objects["Cutter"]
    cutter.location, cutter.scale = surface.location, surface.scale
    update()
    return waved


@pytest.mark.parametrize("name", SHAPING)
def test_roots_keep_their_bits_on_any_object(turned, name):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use_tool(name)
    assert np.array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(points(turned), grown_from_nothing(turned), atol=2e-6)


def test_lengths_are_those_of_the_world(turned):
    after, _strands = use_tool("guide_length", method="SET", length=0.3)
    np.testing.assert_allclose(2.0 * lengths_of(after), 0.3, rtol=1e-4)
    assert guide_tools.median_length(bpy.data.objects["Guides"].data) == pytest.approx(0.3, rel=1e-4)


def test_a_cutter_cuts_where_it_is_in_the_world(turned):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use_tool("trim_guides")
    # Twice as large, the cutter has a radius of 1.2 in the coordinates of the sphere.
    reaches = np.linalg.norm(before, axis=2).max(axis=1)
    crosses, stays = reaches > 1.21, reaches < 1.18
    assert min(crosses.sum(), stays.sum()) > 3
    np.testing.assert_allclose(np.linalg.norm(after[crosses, -1], axis=1), 1.2, atol=0.01)
    assert np.array_equal(after[stays], before[stays])


def an_empty(location, rotation=(0.0, 0.0, 0.0)):
    made = bpy.data.objects.new("Plane", None)
    made.location, made.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(made)
    update()
    return made


def test_an_empty_cuts_off_what_is_on_its_z_side(turned):
    before = points(bpy.data.objects["Guides"])
    plane = an_empty((1.0, 2.0, 3.3), (np.pi + 0.4, -0.3, 0.0))
    after, _strands = use_tool("trim_guides", cutter="Plane")
    to_plane = np.array(plane.matrix_world.inverted() @ bpy.data.objects["Sphere"].matrix_world)
    was, now = (p @ to_plane[:3, :3].T + to_plane[:3, 3] for p in (before, after))
    is_below = was[:, 0, 2] < 0.0
    assert was[is_below, :, 2].max() > 0.1 and now[is_below, :, 2].max() < 1e-5
    assert np.array_equal(after[~is_below], before[~is_below])


def test_a_deformed_surface_is_cut_where_it_is_seen(waved):
    """A surface stretched by a modifier is cut where it is seen: rendered hair ends at the plane, and roots follow."""
    surface = bpy.data.objects["Sphere"]
    modifier = surface.modifiers.new("Stretch", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.factor, modifier.deform_axis = "STRETCH", 0.6, "Z"
    update()
    an_empty((0.0, 0.0, 0.5), (np.pi, 0.0, 0.0))
    guides = bpy.data.objects["Guides"]
    seen = evaluated(guides)
    use_tool("trim_guides", cutter="Plane")
    now = evaluated(guides)
    is_above = seen[:, 0, 2] > 0.5
    assert seen[is_above, :, 2].min() < 0.4 and now[is_above, :, 2].min() > 0.5 - 1e-3
    assert_follows(guides, waved)


def evaluated(curves_object):
    found = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(found.points), 3), np.float32)
    found.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions.reshape(len(found.curves), -1, 3)


@pytest.mark.parametrize("name", share_of(TOOLS, 2))
def test_hair_follows_on_a_deformed_surface(waved, name):
    modifier = bpy.data.objects["Sphere"].modifiers.new("Bend", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.angle = "BEND", 0.9
    update()
    use_tool(name)
    assert_follows(bpy.data.objects["Guides"], waved)


def test_errors_change_nothing(waved):
    guides = bpy.data.objects["Guides"]
    before, everything = points(guides), snapshot()
    assert "no vertex group" in said_by("smooth_guides", mask="none")
    assert "Pick the object that cuts" in said_by("trim_guides", cutter="")
    assert "There is no object" in said_by("trim_guides", cutter="none")
    assert "is the surface" in said_by("trim_guides", cutter="Sphere")
    assert "Select the guides to copy from" in said_by("copy_guide_shape", source="")
    assert "no vertex group" in said_by("copy_guide_shape", target="none")
    select_guides(guides, before[:, 0, 2] < -0.2)
    assert "both selected and inside the mask" in said_by("lift_guides", mask="top")
    bpy.data.objects["Cutter"].scale = (0.0, 0.0, 0.0)
    update()
    assert "scale of zero" in said_by("trim_guides")
    assert np.array_equal(points(guides), before) and snapshot() == everything


@pytest.mark.parametrize("name", share_of(TOOLS, 2))
def test_guides_without_a_surface_or_with_broken_points_are_refused(waved, name):
    guides = bpy.data.objects["Guides"]
    broken = points(guides)
    broken[5, 3] = np.nan
    guides.data.attributes["position"].data.foreach_set("vector", broken.ravel())
    assert "non-finite" in said_by(name)
    bpy.data.objects.remove(bpy.data.objects["Sphere"])
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    assert "The surface is missing" in said_by(name)


def test_no_guides_left(waved):
    bpy.data.objects["Guides"].data.remove_curves(indices=list(range(60)))
    for name in TOOLS:
        assert "has no guides" in said_by(name)


@pytest.fixture
def ragged(imported):
    """Return curves of 2 to 12 points used as guides, some of them smooth, with hair."""
    bpy.context.view_layer.objects.active = imported
    bpy.ops.vellus.use_as_guides(surface="Sphere", strand_count=300)
    imported.data.set_types(type="CATMULL_ROM", indices=list(range(0, len(imported.data.curves), 2)))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2.3, location=(1.0, 2.0, 3.0))
    bpy.context.object.name = "Cutter"
    bpy.context.view_layer.objects.active = imported
    update()
    return imported


@pytest.mark.parametrize("name", share_of(TOOLS, 2))
def test_guides_of_any_point_counts(ragged, name):
    counts, firsts = curves.point_counts(ragged.data), curves.first_points(ragged.data)
    before = curves.read_points(ragged.data)
    named = attribute(ragged, "clump")
    assert getattr(bpy.ops.vellus, name)(**TOOLS[name]) == {"FINISHED"}
    update()
    after = curves.read_points(ragged.data)
    assert np.isfinite(after).all() and curves.is_hand_made(ragged.data)
    if name in SHAPING:
        assert np.array_equal(curves.point_counts(ragged.data), counts)
        assert np.array_equal(curves.first_points(ragged.data), firsts)
        assert not np.array_equal(after, before)
    elif name == "change_guide_count":
        assert np.array_equal(after[: len(before)], before)
        assert np.array_equal(attribute(ragged, "clump")[: len(named)], named)
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    assert hair.data.vellus.status == "" and np.array_equal(points(hair), grown_from_nothing(hair))


def test_any_tools_in_any_order(waved, rng):
    """Tools with any values in any order, some undone, keep guides finite and hair interpolated from the guides."""
    names = sorted(TOOLS)
    for _ in range(40):
        name = names[rng.integers(len(names))]
        values = {"factor": float(rng.choice([0.3, 0.9, 1.0, 1.4]))} if "factor" in TOOLS[name] else {}
        if name in CHOSEN and rng.random() < 0.3:
            values["mask"] = "top"
        if rng.random() < 0.2:
            guides = bpy.data.objects["Guides"]
            select_guides(guides, rng.random(len(guides.data.curves)) < 0.5)
        try:
            use_tool(name, **values)
        except RuntimeError as error:
            assert "Traceback" not in str(error)
        if rng.random() < 0.3:
            bpy.ops.ed.undo()
            update()
        assert np.isfinite(points(bpy.data.objects["Guides"])).all()
    hair = bpy.data.objects["Hair"]
    assert np.array_equal(points(hair), grown_from_nothing(hair))
