# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding, removing and mirroring guides keeps all bits and attributes of the other guides."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, stored_roots
from hair_addon.core.geometry import mesh
from tests.support.dynamics.following import surface_points, update
from tests.support.guide_tools import grown_from_nothing, select_guides, wave
from tests.support.reading import attribute, points
from tests.support.scenes import even_guides


@pytest.fixture
def groom(hair):
    """Return hair between combed guides with an attribute of the artist's own."""
    guides = bpy.data.objects["Guides"]
    wave(guides)
    named = guides.data.attributes.new("clump", "INT", "CURVE")
    named.data.foreach_set("value", np.arange(60, dtype=np.int32))
    widths = guides.data.attributes.new("width", "FLOAT", "POINT")
    widths.data.foreach_set("value", np.tile(np.linspace(1.0, 0.0, 41, dtype=np.float32), 60))
    bpy.ops.ed.undo_push(message="combed")
    return hair


@pytest.fixture
def combed(groom):
    """Return the object of the guides."""
    return bpy.data.objects["Guides"]


def rows(guides):
    """Return the clump of each guide, by which tests and artists identify it."""
    return attribute(guides, "clump")


def test_guides_that_were_there_keep_every_bit(combed):
    before = {a.name: values_of(combed, a.name) for a in combed.data.attributes}
    bpy.ops.vellus.change_guide_count(factor=2.0)
    update()
    assert len(combed.data.curves) == 120
    for name, values in before.items():
        assert np.array_equal(values_of(combed, name)[: len(values)], values), name


def values_of(curves_object, name):
    made = curves_object.data.attributes[name]
    width = {"FLOAT_VECTOR": 3, "FLOAT2": 2}.get(made.data_type, 1)
    values = np.empty(len(made.data) * width, {"INT": np.int32, "INT8": np.int8}.get(made.data_type, np.float32))
    made.data.foreach_get("vector" if width > 1 else "value", values)
    return values.reshape(-1, width)


def test_new_guides_are_rooted_and_known(combed, groom):
    bpy.ops.vellus.change_guide_count(factor=2.0)
    update()
    np.testing.assert_allclose(points(combed)[:, 0], surface_points(combed), atol=1e-6)
    assert len(set(attribute(combed, "id"))) == 120
    assert np.array_equal(
        attribute(combed, "width").reshape(120, 41)[60:], np.tile(attribute(combed, "width")[:41], (60, 1))
    )
    # Each has the clump of the nearest guide that was there.
    roots = points(combed)[:, 0]
    nearest = np.linalg.norm(roots[60:, None] - roots[None, :60], axis=2).argmin(axis=1)
    assert np.mean(rows(combed)[60:] == nearest) > 0.95
    assert np.array_equal(points(groom), grown_from_nothing(groom))


@even_guides
def test_new_guides_are_shaped_like_those_around(combed):
    """New guides on a groom that leans one way lean like the others and have their length."""
    combed.data.vellus.keeps_outside = False  # some lean into the sphere
    straight = points(combed)
    along = np.linspace(0.0, 0.5, 41)[None, :, None]
    straight = straight[:, :1] + along * (straight[:, :1] * 0.6 + np.array([0.0, 0.8, 0.0]))
    combed.data.attributes["position"].data.foreach_set("vector", straight.astype(np.float32).ravel())
    update()
    bpy.ops.vellus.change_guide_count(factor=3.0)
    new = points(combed)[60:]
    wanted = new[:, :1] + along * (new[:, :1] * 0.6 + np.array([0.0, 0.8, 0.0]))
    assert np.abs(new - wanted).max() < 0.12 and np.median(np.linalg.norm(new - wanted, axis=2)) < 0.02


def test_more_where_guides_are_selected(combed):
    chosen = points(combed)[:, 0, 2] > 0.3
    select_guides(combed, chosen)
    bpy.ops.vellus.change_guide_count(factor=2.0)
    assert len(combed.data.curves) == 60 + chosen.sum()
    roots = points(combed)[:, 0]
    nearest = np.linalg.norm(roots[60:, None] - roots[None, :60], axis=2).argmin(axis=1)
    assert chosen[nearest].mean() > 0.9


def test_more_inside_a_mask(combed):
    bpy.ops.vellus.change_guide_count(method="COUNT", guide_count=100, mask="top")
    roots = points(combed)[:, 0]
    assert len(roots) == 100 and roots[60:, 2].min() > -0.15


def test_more_only_where_guides_were_placed(sphere):
    """Guides are added only where guides were placed: those of a masked half remain in that half."""
    bpy.ops.vellus.distribute_guides(guide_count=40, length=0.3, density_group="top")
    guides = bpy.data.objects["Guides"]
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.change_guide_count(factor=3.0)
    assert len(guides.data.curves) == 120 and points(guides)[:, 0, 2].min() > -0.15


def test_more_hand_made_guides_stay_among_them(sphere):
    bpy.ops.vellus.distribute_guides(guide_count=200, length=0.3)
    guides = bpy.data.objects["Guides"]
    guides.data.remove_curves(indices=[int(i) for i in np.flatnonzero(points(guides)[:, 0, 2] < 0.3)])
    guides.data.vellus.written = curves.BY_HAND
    bpy.context.view_layer.objects.active = guides
    count = len(guides.data.curves)
    bpy.ops.vellus.change_guide_count(factor=2.0)
    assert len(guides.data.curves) == 2 * count and points(guides)[:, 0, 2].min() > 0.0


def test_fewer_guides_are_some_of_those_that_were_there(combed, groom):
    before = points(combed)
    bpy.ops.vellus.change_guide_count(factor=0.5)
    update()
    assert len(combed.data.curves) == 30
    assert np.array_equal(points(combed), before[rows(combed)])
    assert np.array_equal(points(groom), grown_from_nothing(groom))


def test_fewer_only_where_guides_are_selected(combed):
    chosen = points(combed)[:, 0, 2] > 0.0
    select_guides(combed, chosen)
    bpy.ops.vellus.change_guide_count(factor=0.4)
    assert set(np.flatnonzero(~chosen)) <= set(rows(combed))
    assert len(combed.data.curves) == 60 - round(0.6 * chosen.sum())


def test_one_guide_is_always_left(combed):
    bpy.ops.vellus.change_guide_count(factor=0.001)
    assert len(combed.data.curves) == 1
    with pytest.raises(RuntimeError, match="No more guides can be removed"):
        bpy.ops.vellus.change_guide_count(factor=0.001)


def test_the_same_count_changes_nothing(combed):
    before = points(combed)
    bpy.ops.vellus.change_guide_count(method="COUNT", guide_count=60)
    bpy.ops.vellus.change_guide_count(factor=1.0)
    assert np.array_equal(points(combed), before) and not combed.data.vellus.status


def test_new_guides_keep_to_their_side_of_a_part_line(groom, combed):
    """New guides keep to their side of a part line from which guides lean away, and none stands upright between
    them.
    """
    line = bpy.data.curves.new("Parting", "CURVE")
    line.dimensions = "3D"
    spline = line.splines.new("POLY")
    turn = np.linspace(-np.pi, np.pi, 60)
    spline.points.add(59)
    for place, angle in zip(spline.points, turn, strict=True):
        place.co = (0.0, 1.001 * np.sin(angle), 1.001 * np.cos(angle), 1.0)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Parting", line))
    groom.data.vellus.hair.part_lines = "Parting"
    update()
    strands = points(combed)
    side = np.where(strands[:, 0, 0] > 0.0, 1.0, -1.0)
    along = np.linspace(0.0, 0.3, 41)[None, :, None]
    leaning = strands[:, :1] + along * side[:, None, None] * np.array([1.0, 0.0, 0.0])
    combed.data.attributes["position"].data.foreach_set("vector", leaning.astype(np.float32).ravel())
    combed.data.update_tag()
    update()
    bpy.ops.vellus.change_guide_count(factor=4.0)
    new = points(combed)[60:]
    lean = (new[:, -1, 0] - new[:, 0, 0]) * np.sign(new[:, 0, 0])
    near = np.abs(new[:, 0, 0]) > 0.01
    assert lean[near].min() > 0.0 and np.mean(lean[near] > 0.2) > 0.95


def image_of(strands):
    return strands * np.float32([-1.0, 1.0, 1.0])


@pytest.mark.parametrize("direction", ["FROM_POSITIVE", "FROM_NEGATIVE"])
@pytest.mark.parametrize("is_turned", [False, True])
def test_a_mirrored_groom_is_its_own_image(combed, groom, direction, is_turned):
    if is_turned:
        surface = bpy.data.objects["Sphere"]
        surface.location, surface.rotation_euler, surface.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
        update()
    sign = 1.0 if direction == "FROM_POSITIVE" else -1.0
    before = points(combed)
    bpy.ops.vellus.mirror_guides(direction=direction)
    update()
    after = points(combed)
    known, first, which = np.unique(rows(combed), return_index=True, return_inverse=True)
    is_image = np.ones(len(after), bool)
    is_image[first] = False
    sources, images = after[first[which[is_image]]], after[is_image]
    assert len(images) > 20 and (sign * sources[:, 0, 0]).min() > 0.0
    # On an ico sphere, whose faces are not quite symmetric: where the surface is, and the same shape to rounding.
    np.testing.assert_allclose(images[:, 0], image_of(sources[:, 0]), atol=5e-3)
    np.testing.assert_allclose(images - images[:, :1], image_of(sources - sources[:, :1]), atol=1e-5)
    # Nothing else is left on that side but near the plane, and what stays has its bits.
    others = after[~is_image]
    assert (sign * others[:, 0, 0]).min() > -0.05
    assert np.array_equal(others, before[known])
    np.testing.assert_allclose(after[:, 0], surface_points(combed), atol=1e-5)
    assert len(set(attribute(combed, "id"))) == len(after)
    np.testing.assert_allclose(points(groom), grown_from_nothing(groom), atol=2e-6)


def test_mirroring_twice_changes_nothing_more(combed):
    bpy.ops.vellus.mirror_guides()
    once = points(combed)
    bpy.ops.vellus.mirror_guides()
    twice = points(combed)
    assert len(once) == len(twice)
    pairs = np.linalg.norm(once[:, None, 0] - twice[None, :, 0], axis=2).argmin(axis=1)
    assert len(set(pairs)) == len(once)
    np.testing.assert_allclose(twice[pairs], once, atol=1e-5)


def test_only_images_of_selected_guides(combed):
    before = points(combed)
    select_guides(combed, before[:, 0, 2] > 0.0)
    bpy.ops.vellus.mirror_guides()
    after, kept = points(combed), rows(combed)
    low = before[:, 0, 2] < -0.3
    assert set(np.flatnonzero(low)) <= set(kept)
    new = after[len(after) - np.count_nonzero((before[:, 0, 2] > 0.0) & (before[:, 0, 0] > 0.02)) :]
    assert new[:, 0, 2].min() > -0.05 and new[:, 0, 0].max() < 0.0


def test_there_must_be_guides_on_the_side(combed):
    combed.data.remove_curves(indices=[int(i) for i in np.flatnonzero(points(combed)[:, 0, 0] < 0.1)])
    with pytest.raises(RuntimeError, match="choose the other direction"):
        bpy.ops.vellus.mirror_guides(direction="FROM_NEGATIVE")
    count = len(combed.data.curves)
    bpy.ops.vellus.mirror_guides()
    assert len(combed.data.curves) == 2 * count


@pytest.mark.parametrize("tool", ["change_guide_count", "mirror_guides"])
def test_guides_rooted_off_the_surface_keep_their_roots(imported, tool):
    """Guides rooted off the surface keep their roots, and mirrored guides are as far from it as their originals."""
    bpy.context.view_layer.objects.active = imported
    bpy.ops.vellus.use_as_guides(surface="Sphere", grows_hair=False)
    off = curves.read_points(imported.data) + np.float32([0.0, 0.0, 0.01])
    imported.data.attributes["position"].data.foreach_set("vector", off.ravel())
    apart = imported.data.attributes["root_distance"]
    surface = scene.read_surface(bpy.data.objects["Sphere"], bpy.context.evaluated_depsgraph_get())
    stored = stored_roots.points(imported.data, surface)
    places = surface.from_local(curves.first_points(imported.data))
    gaps = np.linalg.norm(places - mesh.positions(surface.mesh, stored), axis=1) / surface.scale
    apart.data.foreach_set("value", gaps.astype(np.float32))
    getattr(bpy.ops.vellus, tool)()
    stored = stored_roots.points(imported.data, surface)
    found = curves.read_roots(imported.data, surface, surface.from_local(curves.first_points(imported.data)))
    assert found.is_same(stored) and len(stored) != len(places)
