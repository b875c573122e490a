# SPDX-License-Identifier: GPL-3.0-or-later
"""*Gather* works on surfaces with any transform and pose, keeps guides outside, and is recorded by layers."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from hair_addon import api
from hair_addon.blender.data.strands import curves, frozen_points, gathered_groups
from hair_addon.blender.groom import pipeline
from hair_addon.blender.groom.guides import gathered_guides
from hair_addon.core.errors import HairError
from tests.support.reading import evaluated_points, points, write_points

SIZES = {"tie_radius": 0.05, "tail_radius": 0.08, "bun_radius": 0.2, "pitch": 0.3, "clearance": 0.02}
LINE = ((0.0, 0.6, 0.8), (0.0, 0.9, 1.1), (0.0, 1.3, 0.6), (0.0, 1.3, -1.0))


@pytest.fixture
def guides(hair):
    """Return guides on a sphere of radius 1, as long as half its circumference."""
    found = bpy.data.objects["Guides"]
    api.change_guides(found, "LENGTH", method="SET", length=3.0)
    bpy.context.view_layer.update()
    return found


def add_line(matrix=None, lines=(LINE,)):
    """Return a curve object with points at places in the coordinates of the sphere."""
    data = bpy.data.curves.new("Tie", "CURVE")
    data.dimensions = "3D"
    for line in lines:
        spline = data.splines.new("POLY")
        spline.points.add(len(line) - 1)
        for point, place in zip(spline.points, line, strict=True):
            point.co = (*((matrix or Matrix()) @ Vector(place)), 1.0)
    found = bpy.data.objects.new("Tie", data)
    bpy.context.scene.collection.objects.link(found)
    bpy.context.view_layer.update()
    return found


def gather(found, **settings):
    count = api.change_guides(found, "GATHER", line="Tie", **{**SIZES, **settings})
    bpy.context.view_layer.update()
    return count


def segments(shape):
    return np.linalg.norm(np.diff(shape.astype(np.float64), axis=1), axis=2)


@pytest.mark.parametrize("shape", ["PONYTAIL", "BUN"])
def test_guides_are_gathered_outside_of_the_surface(guides, shape):
    add_line()
    before = points(guides)
    assert gather(guides, shape=shape) == len(before)
    after = points(guides)
    assert np.array_equal(after[:, 0], before[:, 0])
    if shape != "BUN":  # whose guides become as long as its coil
        np.testing.assert_allclose(segments(after), segments(before), rtol=0.01)
    assert np.linalg.norm(after[:, 1:], axis=2).min() > 0.993
    is_long = np.linalg.norm(before[:, 0] - LINE[0], axis=1) < 1.6
    tips = after[is_long, -1]
    if shape == "BUN":
        assert np.linalg.norm(tips - 1.22 * np.array(LINE[0]), axis=1).max() < 0.4
    else:
        assert np.abs(tips[:, 0]).max() < 0.3 and tips[:, 1].min() > 0.5
    hair = points(bpy.data.objects["Hair"])
    assert np.abs(hair[:, -1, 0]).mean() < 0.3  # it follows


@pytest.mark.parametrize("shape", ["BRAID", "BUN"])
def test_strands_lie_among_their_guides_behind_the_tie(guides, shape):
    """The offset of a strand's root from its guides ends at the tie, also after guides were added."""
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)  # all reach the tie
    gather(guides, shape=shape)
    for is_denser in (False, True):
        if is_denser:
            api.change_guides(guides, "COUNT", guide_count=2 * len(guides.data.curves))
            bpy.context.view_layer.update()
        by_guides, by_strands = points(guides), points(bpy.data.objects["Hair"])
        behind = by_guides.shape[1] // 2
        least, most = by_guides[:, behind:].min(axis=0) - 1e-4, by_guides[:, behind:].max(axis=0) + 1e-4
        assert ((by_strands[:, behind:] >= least) & (by_strands[:, behind:] <= most)).all()


def test_new_guides_go_through_the_tie(guides):
    """Behind the tie, new guides are means of gathered guides, also without layers."""
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    gather(guides)
    before = points(guides)
    api.change_guides(guides, "COUNT", guide_count=2 * len(before))
    added, behind = points(guides)[len(before) :], before.shape[1] * 3 // 4
    least, most = before[:, behind:].min(axis=0) - 1e-4, before[:, behind:].max(axis=0) + 1e-4
    assert len(added) and ((added[:, behind:] >= least) & (added[:, behind:] <= most)).all()


def test_ties_stay_where_they_are_if_guides_are_cut(guides):
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    gather(guides, shape="BRAID")
    lengths = []
    for _time in range(2):
        tie_fractions, along = gathered_groups.tie_fractions_of(guides.data), segments(points(guides)).cumsum(axis=1)
        along = np.pad(along, ((0, 0), (1, 0)))
        numbers = np.arange(along.shape[1])
        lengths.append(
            [np.interp(tie * numbers[-1], numbers, own) for tie, own in zip(tie_fractions, along, strict=True)]
        )
        api.change_guides(guides, "LENGTH", method="SET", length=4.0, shorten="CUT")
    assert np.max(lengths[0]) < 4.0
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=0.02)
    held, tie_fractions = gathered_groups.read(guides.data).held, gathered_groups.tie_fractions_of(guides.data)
    api.change_guides(guides, "LENGTH", method="SCALE", factor=1.5)  # scaled guides keep their fractions
    np.testing.assert_allclose(gathered_groups.read(guides.data).held, held, rtol=1e-5)
    np.testing.assert_array_equal(gathered_groups.tie_fractions_of(guides.data), tie_fractions)


def tie_lengths(guides):
    """Return the lengths (G,) from roots to ties."""
    along = np.pad(segments(points(guides)).cumsum(axis=1), ((0, 0), (1, 0)))
    numbers, fractions = np.arange(along.shape[1]), gathered_groups.tie_fractions_of(guides.data)
    return np.array([np.interp(tie * numbers[-1], numbers, own) for tie, own in zip(fractions, along, strict=True)])


def resampled(shape, length):
    """Return a guide (P, 3) cut or extended at its tip to a length as Grow / Shrink Curves does: all points move."""
    along = np.insert(segments(shape[None])[0].cumsum(), 0, 0.0)
    ahead = (shape[-1] - shape[-2]) / np.linalg.norm(shape[-1] - shape[-2])
    line, along = np.vstack([shape, shape[-1] + 10.0 * ahead]), np.append(along, along[-1] + 10.0)
    places = along[:-1] * length / along[-2]
    return np.stack([np.interp(places, along, axis) for axis in line.T], axis=1)


@pytest.mark.parametrize("is_scaled", [False, True])
def test_ties_stay_where_they_are_if_brushes_change_lengths(guides, is_scaled):
    """Brushes cut and extend guides at their tips, or scale them about their roots, by a little in each event."""
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    gather(guides, shape="BRAID")
    before, held = tie_lengths(guides), gathered_groups.read(guides.data).held * segments(points(guides)).sum(axis=1)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    bpy.context.view_layer.update()
    for factor in (0.9, 0.8, 0.9, 1.05):
        own = points(guides)
        root, lengths = own[:, :1], factor * segments(own).sum(axis=1)
        write_points(
            guides,
            root + factor * (own - root)
            if is_scaled
            else np.stack([resampled(line, length) for line, length in zip(own, lengths, strict=True)]),
        )
        bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="OBJECT")
    scale = 0.9 * 0.8 * 0.9 * 1.05 if is_scaled else 1.0
    np.testing.assert_allclose(tie_lengths(guides), scale * before, rtol=0.02)
    now = gathered_groups.read(guides.data).held * segments(points(guides)).sum(axis=1)
    is_held = gathered_groups.read(guides.data).held < 1.0
    np.testing.assert_allclose(now[is_held], scale * held[is_held], rtol=0.02)
    anew = pipeline.bind_hair(*pipeline.inputs_of(bpy.data.objects["Hair"].data), bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), anew.points, atol=1e-5)


def test_ties_stay_on_frozen_guides_that_brushes_would_cut(guides):
    """Frozen points return after each event, so ties follow guides as they are then."""
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    gather(guides, shape="BRAID")
    before, own = tie_lengths(guides), points(guides)
    fractions, held = gathered_groups.tie_fractions_of(guides.data), gathered_groups.read(guides.data).held
    are_frozen = np.arange(len(own)) % 2 == 0
    frozen_points.write(guides.data, np.repeat(are_frozen, own.shape[1]))
    bpy.context.view_layer.objects.active = guides
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    bpy.context.view_layer.update()
    lengths = 0.8 * segments(own).sum(axis=1)
    write_points(guides, np.stack([resampled(line, length) for line, length in zip(own, lengths, strict=True)]))
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_array_equal(points(guides)[are_frozen], own[are_frozen])
    np.testing.assert_allclose(tie_lengths(guides), before, rtol=0.02)
    np.testing.assert_allclose(gathered_groups.tie_fractions_of(guides.data)[are_frozen], fractions[are_frozen])
    np.testing.assert_allclose(gathered_groups.read(guides.data).held[are_frozen], held[are_frozen], rtol=1e-6)


def test_ties_of_guides_with_fewer_points_than_strands(guides):
    """Strands follow guides with points at equal spacing, but gathered guides have shorter segments near roots."""
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    some = np.ascontiguousarray(points(guides)[:, np.linspace(0, 40, 21).astype(int)])
    guides.data.resize_curves([21] * len(some))
    guides.data.attributes["position"].data.foreach_set("vector", some.ravel())
    guides.data.update_tag()
    gather(guides, shape="BUN")
    even, tie_fractions = curves.even_local_points(guides.data), gathered_groups.tie_fractions_of(guides.data)
    at_tie = even[np.arange(len(even)), np.rint(40.0 * tie_fractions).astype(int)]
    assert even.shape[1] == 41 and np.linalg.norm(at_tie - LINE[0], axis=1).max() < 0.3


def test_transferred_guides_are_held_up_to_their_ties(guides):
    """The length up to the tie, in local units, is scaled with the surface."""
    add_line()
    gather(guides)
    other = guides.data.surface.copy()
    other.data = other.data.copy()
    other.data.transform(Matrix.Scale(100.0, 4))
    bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    copies = api.transfer_groom(guides, other).guides
    found, expected = gathered_groups.read(copies), gathered_groups.read(guides.data)
    np.testing.assert_array_equal(found.groups, expected.groups)
    np.testing.assert_allclose(found.held, expected.held, rtol=1e-4)


def test_hair_in_regions_of_its_surface_follows_new_ties(guides):
    """Hair with regions of its surface is bound to new ties of its guides at once."""
    mesh, hair = bpy.data.objects["Sphere"].data, bpy.data.objects["Hair"]
    mesh.attributes.new("side", "INT", "FACE")
    mesh.update()
    hair.data.vellus.hair.region_attribute = "side"
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    for shape in ("PONYTAIL", "BRAID"):
        gather(guides, shape=shape)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        anew = pipeline.bind_hair(*pipeline.inputs_of(hair.data), depsgraph)
        np.testing.assert_allclose(points(hair), anew.points, atol=1e-5)


def test_hair_is_not_parted_by_ties_that_a_script_removes(guides):
    hair = bpy.data.objects["Hair"]
    add_line()
    api.change_guides(guides, "LENGTH", method="SET", length=6.0)
    gather(guides)
    parted = points(hair)
    for name in [name for name in guides.data.attributes.keys() if name.startswith(gathered_groups.NAME)]:
        guides.data.attributes.remove(guides.data.attributes[name])
    guides.data.update_tag()
    bpy.context.view_layer.update()
    anew = pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(points(hair), anew.points, atol=1e-5)
    assert np.abs(points(hair) - parted).max() > 0.1 and hair.data.vellus.parting_key == ""


def test_a_line_through_the_surface_keeps_guides_outside(guides):
    add_line(lines=((LINE[0], (0.0, 0.7, 0.95), (0.0, -0.5, -0.5)),))
    before = points(guides)
    gather(guides)
    assert np.linalg.norm(points(guides)[:, 1:], axis=2).min() > 0.993
    np.testing.assert_allclose(segments(points(guides)), segments(before), rtol=0.01)


@pytest.mark.parametrize("change", ["small", "uneven", "mirrored", "turned and parented"])
def test_transformed_surfaces(guides, change):
    """Guides are gathered at the place of the line in the world, with their lengths in the world."""
    sphere = bpy.data.objects["Sphere"]
    if change == "turned and parented":
        parent = bpy.data.objects.new("Parent", None)
        bpy.context.scene.collection.objects.link(parent)
        parent.matrix_world = Matrix.Translation((3.0, 2.0, 1.0)) @ Matrix.Rotation(1.0, 4, "X")
        sphere.parent = parent
    else:
        sphere.scale = {"small": [0.01] * 3, "uneven": [1.0, 1.2, 0.8], "mirrored": [-1.0, 1.0, 1.0]}[change]
    bpy.context.view_layer.update()
    before, size = points(guides), 0.01 if change == "small" else 1.0
    add_line(sphere.matrix_world)
    gather(guides, **{name: size * value for name, value in SIZES.items()})
    after, axes = points(guides), np.array(sphere.matrix_world.to_3x3())
    assert np.array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(segments(after @ axes.T), segments(before @ axes.T), rtol=0.02)
    near = np.linalg.norm(after - np.array(LINE[0]), axis=2).min(axis=1)
    assert np.quantile(near, 0.9) < 0.2
    assert np.linalg.norm(after[:, 1:], axis=2).min() > 0.99


def test_guides_are_gathered_on_the_posed_surface(guides):
    sphere = bpy.data.objects["Sphere"]
    sphere.shape_key_add(name="Basis")
    key = sphere.shape_key_add(name="Moved")
    for point in key.data:
        point.co = Matrix.Rotation(0.5, 3, "X") @ point.co + Vector((0.0, 0.0, 2.0))
    key.value = 1.0
    bpy.context.view_layer.update()
    posed = Matrix.Translation((0.0, 0.0, 2.0)) @ Matrix.Rotation(0.5, 4, "X")
    add_line(posed)
    gather(guides)
    near = np.linalg.norm(evaluated_points(guides) - np.array(posed @ Vector(LINE[0])), axis=2).min(axis=1)
    assert np.quantile(near, 0.9) < 0.2


def test_a_layer_loosens_gathered_guides(guides):
    api.add_layer(guides)
    api.add_layer(guides, "Gathered")
    before = points(guides)
    add_line()
    gather(guides)
    gathered = points(guides)
    guides.data.vellus.layers[1].weight = 0.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(guides), before, atol=1e-5)
    guides.data.vellus.layers[1].weight = 1.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(guides), gathered, atol=1e-4)


def test_a_mask_and_several_ties(guides):
    sides = [((sign, 0.0, 0.0), (1.4 * sign, 0.0, 0.0), (1.4 * sign, 0.0, -2.0)) for sign in (-1.0, 1.0)]
    add_line(lines=sides)
    before = points(guides)
    gather(guides, mask="top", shape="BRAID")
    after = points(guides)
    low, top = before[:, 0, 2] < -0.1, before[:, 0, 2] > 0.1
    assert np.array_equal(after[low], before[low])
    is_aside = top & (np.abs(before[:, 0, 0]) > 0.2)
    assert (np.sign(after[is_aside, -1, 0]) == np.sign(before[is_aside, 0, 0])).all()


@pytest.mark.parametrize(
    "placed", [Matrix(), Matrix.Translation((3.0, 0.0, 0.0)) @ Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0))]
)
def test_cornrows_lie_on_the_surface_beside_their_curves(guides, placed):
    surface = guides.data.surface
    surface.matrix_world = placed @ surface.matrix_world
    guides.matrix_world = placed @ guides.matrix_world
    api.change_guides(guides, "LENGTH", method="SET", length=1.0)
    bpy.context.view_layer.update()
    angles = np.linspace(-1.2, 1.2, 25)
    rows = [[(x, 0.95 * np.sin(a), 0.95 * np.cos(a)) for a in angles] for x in (-0.3, 0.3)]
    add_line(placed, rows)
    before = points(guides)
    gather(guides, shape="CORNROWS")
    after = points(guides)
    assert np.linalg.norm(after[:, 1:], axis=2).min() > 0.993
    root = before[:, 0]
    is_near = (np.abs(np.abs(root[:, 0]) - 0.3) < 0.35) & (np.abs(root[:, 1]) < 0.6) & (root[:, 2] > 0.0)
    is_near &= np.abs(root[:, 0]) > 0.1
    tips = after[is_near, -1]
    assert is_near.sum() > 3
    assert (np.abs(np.abs(tips[:, 0]) - 0.3) < 3.0 * SIZES["tie_radius"]).all()
    assert (np.sign(tips[:, 0]) == np.sign(root[is_near, 0])).all()
    assert np.linalg.norm(tips, axis=1).max() < 1.0 + 5.0 * SIZES["tie_radius"]


def test_lines_that_begin_at_the_end_of_others_continue_them():
    whole = np.stack([np.arange(9.0), np.zeros(9), np.zeros(9)], axis=1)
    other = whole + np.array([0.0, 5.0, 0.0])
    found = gathered_guides.continued([whole[6:], other, whole[:4], whole[4:6]], 1.0)
    assert sorted(map(len, found)) == [9, 9]
    assert any(np.array_equal(line, whole) for line in found) and any(np.array_equal(line, other) for line in found)
    assert len(gathered_guides.continued([whole[6:], whole[:4]], 1.0)) == 2
    ring = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.1, 0.0)])
    assert len(gathered_guides.continued([ring, ring.copy()], 0.2)) == 1


def test_what_cannot_be_gathered_is_refused(guides):
    before = points(guides)
    with pytest.raises(HairError, match="Pick a curve"):
        api.change_guides(guides, "GATHER")
    with pytest.raises(HairError, match="no object"):
        api.change_guides(guides, "GATHER", line="Nothing")
    add_line(lines=(LINE[:1],))
    with pytest.raises(HairError):
        gather(guides)
    assert np.array_equal(points(guides), before)


def groups_of(guides):
    return np.array([value.value for value in guides.data.attributes["gathered"].data])


SIDES = [((sign, 0.0, 0.0), (1.4 * sign, 0.0, 0.0), (1.4 * sign, 0.0, -2.0)) for sign in (-1.0, 1.0)]

PARALLEL = [[(x + sign * 0.25, y, z) for x, y, z in LINE] for sign in (-1.0, 1.0)]


def count_between(hair):
    """Return the number of strands that end between the two tails of `PARALLEL`."""
    tips = points(hair)[:, -1]
    return np.count_nonzero((np.abs(tips[:, 0]) < 0.12) & (tips[:, 1] > 1.0))


def test_strands_stay_with_the_tie_of_their_nearest_guide(guides):
    """Few strands hang between two tails, and a region attribute that the user has picked stays."""
    api.change_guides(guides, "COUNT", factor=8.0)
    add_line(lines=PARALLEL)
    gather(guides)
    hair = bpy.data.objects["Hair"]
    assert hair.data.vellus.hair.region_attribute == "gathered"
    parted = count_between(hair)
    hair.data.vellus.hair.region_attribute = ""
    bpy.context.view_layer.update()
    assert 4 * parted < count_between(hair)
    own = guides.data.attributes.new("own", "INT", "CURVE")
    own.data.foreach_set("value", np.ones(len(guides.data.curves), np.int32))
    hair.data.vellus.hair.region_attribute = "own"
    gather(guides)
    assert hair.data.vellus.hair.region_attribute == "own"


def test_guides_that_are_gathered_later_have_groups_of_their_own(guides):
    add_line(lines=SIDES[:1])
    gather(guides, mask="top")
    before = groups_of(guides)
    first = before > 0
    assert first.any() and not first.all()
    guides.data.attributes.new(".selection", "BOOLEAN", "CURVE").data.foreach_set("value", ~first)
    gather(guides, selected_only=True)
    groups = groups_of(guides)
    assert np.array_equal(groups[first], before[first])
    assert groups[~first].min() > before.max()


def test_added_and_mirrored_guides_are_in_groups(guides):
    """New guides take the group of the guides around them; mirrored ties are apart, a tie in the middle is not."""
    add_line(lines=SIDES)
    gather(guides)
    api.change_guides(guides, "COUNT", factor=2.0)
    assert np.array_equal(groups_of(guides) == 1, points(guides)[:, -1, 0] < 0.0)
    api.change_guides(guides, "MIRROR")
    tips, groups = points(guides)[:, -1], groups_of(guides)
    assert not set(groups[tips[:, 0] < 0.0]) & set(groups[tips[:, 0] > 0.0])
    bpy.data.objects.remove(bpy.data.objects["Tie"])
    add_line()
    gather(guides)
    api.change_guides(guides, "MIRROR")
    assert (groups_of(guides) == 1).all()


@pytest.mark.parametrize("is_grown_again", [False, True])
def test_new_guides_of_layers_are_in_the_bun(guides, is_grown_again):
    """Means of turns by whole circles would leave the bun."""
    api.add_layer(guides)
    add_line()
    gather(guides, shape="BUN")
    before = points(guides)
    if is_grown_again:
        guides.data.vellus.guides.guide_count = 180
        new = slice(None)
    else:
        api.change_guides(guides, "COUNT", factor=3.0)
        new = slice(len(before), None)
    bpy.context.view_layer.update()
    after = points(guides)
    assert len(after) == 180 and (is_grown_again or np.array_equal(after[: len(before)], before))
    ends = after[new, -12:] - np.array(LINE[0])
    assert np.median(np.linalg.norm(ends, axis=2).max(axis=1)) < 1.5 * SIZES["bun_radius"]


def test_layers_carry_groups_to_guides_that_are_grown_again(guides):
    api.add_layer(guides)
    add_line(lines=SIDES)
    gather(guides)
    guides.data.vellus.guides.guide_count = 80
    bpy.context.view_layer.update()
    assert len(guides.data.curves) == 80
    assert np.array_equal(groups_of(guides) == 1, points(guides)[:, -1, 0] < 0.0)


def test_guides_that_are_no_longer_gathered_part_no_hair(guides):
    add_line(lines=SIDES)
    gather(guides)
    hair = bpy.data.objects["Hair"]
    count = len(hair.data.curves)
    guides.data.attributes.remove(guides.data.attributes["gathered"])
    hair.data.vellus.hair.strand_count += 1
    bpy.context.view_layer.update()
    assert not hair.data.vellus.status and len(hair.data.curves) == count + 1
