# SPDX-License-Identifier: GPL-3.0-or-later
"""Copy Guide Shape copies from a selection or a group to a group, a selection or all other guides."""

import bpy
import numpy as np
import pytest

from tests.support.dynamics.following import update
from tests.support.guide_tools import grown_from_nothing, lengths_of, select_guides
from tests.support.reading import points, vertex_positions, write_points
from tests.support.scenes import even_guides


@pytest.fixture
def groom(hair):  # `hair` makes the guides
    """Return guides of which those on the +X cap hang down and are short, the others stand straight. Groups: right,
    left.
    """
    surface, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"]
    places = vertex_positions(surface)
    for name, sign in (("right", 1.0), ("left", -1.0)):
        group = surface.vertex_groups.new(name=name)
        group.add([int(i) for i in np.flatnonzero(sign * places[:, 0] > 0.4)], 1.0, "REPLACE")
    strands = points(guides)
    along = np.linspace(0.0, 0.4, 41)[None, :, None]
    up = strands[:, :1]
    straight = up + along * up
    hanging = up + 0.5 * along * (up + 8.0 * along * np.array([0.0, 0.0, -1.0]))
    write_points(guides, np.where(up[:, :, :1] > 0.2, hanging, straight))
    bpy.context.view_layer.objects.active = guides
    return hair


def sides(strands):
    return strands[:, 0, 0] > 0.55, strands[:, 0, 0] < -0.55


@even_guides
@pytest.mark.parametrize("mapping", ["FITTED", "MIRRORED", "NEAREST"])
def test_the_left_hangs_down_like_the_right(groom, mapping):
    guides = bpy.data.objects["Guides"]
    before = points(guides)
    right, left = sides(before)
    bpy.ops.vellus.copy_guide_shape(source="right", target="left", mapping=mapping)
    update()
    after = points(guides)
    has_changed = (after != before).any(axis=(1, 2))
    assert not has_changed[after[:, 0, 0] > -0.1].any() and has_changed[left].all()
    assert np.array_equal(after[:, 0], before[:, 0])
    drop = (after[:, -1] - after[:, 0])[:, 2] - 0.5 * 0.4 * after[:, 0, 2]
    assert before[left, -1, 2].mean() - before[left, 0, 2].mean() > -0.2
    np.testing.assert_allclose(drop[left], drop[right].mean(), atol=0.25)
    assert drop[left].mean() == pytest.approx(drop[right].mean(), abs=0.1)
    np.testing.assert_allclose(lengths_of(after)[left].mean(), lengths_of(before)[right].mean(), rtol=0.1)
    assert np.array_equal(points(groom), grown_from_nothing(groom))


def test_a_selection_is_a_region(groom):
    guides = bpy.data.objects["Guides"]
    before = points(guides)
    right, _left = sides(before)
    select_guides(guides, right)
    bpy.ops.vellus.copy_guide_shape(target="left")
    by_selection = points(guides)
    assert np.array_equal(by_selection[right], before[right])
    assert not np.array_equal(by_selection, before)
    write_points(guides, before)
    bpy.ops.vellus.copy_guide_shape()  # from the selected ones to all others
    changed = (points(guides) != before).any(axis=(1, 2))
    assert np.array_equal(changed, ~right)


def test_from_a_group_to_a_selection(groom):
    guides = bpy.data.objects["Guides"]
    before = points(guides)
    _right, left = sides(before)
    select_guides(guides, left)
    bpy.ops.vellus.copy_guide_shape(source="right")
    assert np.array_equal((points(guides) != before).any(axis=(1, 2)), left)


def test_lengths_may_stay(groom):
    guides = bpy.data.objects["Guides"]
    before = points(guides)
    bpy.ops.vellus.copy_guide_shape(source="right", target="left", copy_length=False)
    np.testing.assert_allclose(lengths_of(points(guides)), lengths_of(before), rtol=1e-4)


def test_half_an_amount_is_between(groom):
    guides = bpy.data.objects["Guides"]
    before = points(guides)
    bpy.ops.vellus.copy_guide_shape(source="right", target="left", amount=0.5)
    half = lengths_of(points(guides))
    write_points(guides, before)
    bpy.ops.vellus.copy_guide_shape(source="right", target="left")
    whole = lengths_of(points(guides))
    _right, left = sides(before)
    np.testing.assert_allclose(half[left], 0.5 * (lengths_of(before) + whole)[left], rtol=1e-3)


def test_regions_without_guides_are_refused(groom):
    surface = bpy.data.objects["Sphere"]
    surface.vertex_groups.new(name="empty")
    for values, reported in (
        ({"source": "empty"}, "No guide is rooted in"),
        ({"source": "right", "target": "empty"}, "no guides to copy to"),
    ):
        with pytest.raises(RuntimeError, match=reported):
            bpy.ops.vellus.copy_guide_shape(**values)
