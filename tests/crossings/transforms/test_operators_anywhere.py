# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on hair of transformed surfaces: own guides, restored guides, drawn lines, points for curls, imports.

An operator that moves no strand moves none in the world. Any other result is the same in the world as after applying
the transform.
"""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.settings import style_items
from tests.support import placed_hair
from tests.support.exchange.imported import select
from tests.support.pairs import pairs, share_of
from tests.support.placed_hair import require_carried, seen

CHOSEN = ["moved", "turned", "small", "uneven", "mirrored", "on a scaled rig", "on a sheared rig"]


@pytest.fixture(scope="module")
def placed_files(blender, tmp_path_factory):
    """Return a function from one of `placed_hair.PLACES` to the file of a surface there, with vertices to draw a
    line over.
    """
    return placed_hair.files_in(tmp_path_factory.mktemp("placed"), _add_arc)


def _add_arc(body):
    """Add a vertex group of half a circle over the body, with its angles as weights."""
    places = np.array([vertex.co for vertex in body.data.vertices]) - body.data.vertices[0].co
    middle = (places.min(axis=0) + places.max(axis=0)) / 2.0
    x, y, z = (places - middle).T
    group = body.vertex_groups.new(name="arc")
    for index in np.flatnonzero((abs(y - 0.1 * x) < 0.05) & (z > 0.0)):
        group.add([int(index)], np.arctan2(z[index], x[index]) / np.pi, "REPLACE")


def opened(path, is_applied=False):
    """Open a file and apply the transform of its surface; returns the `Placed` hair."""
    bpy.ops.wm.read_homefile(filepath=path)
    bpy.context.view_layer.update()
    if is_applied:
        apply_transform()
    return seen()


def apply_transform():
    select(bpy.data.objects["Body"])
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)


def copy_of(*names):
    """Duplicate objects, and return the copies as named."""
    select(*(bpy.data.objects[name] for name in names))
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    return [next(o for o in bpy.context.selected_objects if o.name.startswith(f"{name}.")) for name in names]


def require_same(found, wanted, size, name=""):
    """Assert equal points and widths in the world, each by a member of `Placed.strands`."""
    tolerance = 2e-6 * size + 1e-6 * abs(wanted[0]).max()
    np.testing.assert_allclose(found[0], wanted[0], rtol=0.0, atol=tolerance, err_msg=name)
    np.testing.assert_allclose(found[1], wanted[1], rtol=1e-4, err_msg=f"widths of {name}")


# ------------------------------------------------------------------------------------------ guides


@pytest.mark.parametrize(("with_body", "place"), pairs([False, True], CHOSEN, 5))
def test_own_guides_are_copies_in_place(placed_files, place, with_body):
    """Own guides are copies in place: hair does not move, and they have the original guides' places on their
    surface.
    """
    before = opened(placed_files(place))
    copies = copy_of(*(["Body"] if with_body else []), "Hair")
    hair = copies[-1]
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.make_own_guides() == {"FINISHED"}
    after, guides = seen(), hair.data.vellus.guide_curves
    (shown,) = (o for o in bpy.data.objects if o.data == guides)
    assert guides != bpy.data.objects["Guides"].data and guides.surface == shown.parent == hair.parent
    for name, wanted in (("Guides", "Guides"), ("Hair", "Hair"), (hair.name, "Hair"), (shown.name, "Guides")):
        require_same(after.strands[name], before.strands[wanted], before.size, name)
    placed_hair.comb(bpy.data.objects["Guides"])
    placed_hair.comb(shown)
    combed = seen()
    moved = np.linalg.norm(combed.strands["Hair"][0] - before.strands["Hair"][0], axis=1)
    assert moved.max() > 0.01 * before.size
    apart = np.linalg.norm(combed.strands[hair.name][0] - combed.strands["Hair"][0], axis=1)
    assert apart.max() <= 1e-4 * before.size + 2e-6 * abs(before.vertices).max()


@pytest.mark.parametrize("place", share_of(CHOSEN, 3))
def test_restored_guides_are_where_they_were(placed_files, place):
    before = opened(placed_files(place))
    select(bpy.data.objects["Hair"])
    bpy.data.objects.remove(bpy.data.objects["Guides"])
    assert bpy.ops.vellus.restore_guides() == {"FINISHED"}
    after = seen()
    for name in ("Guides", "Hair"):
        require_same(after.strands[name], before.strands[name], before.size, name)


# ------------------------------------------------------------------------------------------ drawn lines


def draw(operator, active):
    """Draw a line over the body at points in the world, as the Draw tool does."""
    body, hair = bpy.data.objects["Body"], bpy.data.objects[active]
    select(hair)
    getattr(bpy.ops.vellus, operator)()
    lines = bpy.context.object
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    across = sorted((v for v in body.data.vertices if v.groups), key=lambda v: v.groups[0].weight)
    to_lines = lines.matrix_world.inverted() @ body.matrix_world
    spline = lines.data.splines.new("POLY")
    spline.points.add(len(across) - 1)
    for point, vertex in zip(spline.points, across, strict=True):
        point.co = (*(to_lines @ vertex.co), 1.0)
    bpy.ops.object.mode_set(mode="EDIT")
    getattr(bpy.ops.vellus, operator)()
    assert bpy.context.object == hair
    return seen()


def uncombed(path, is_applied):
    """Open a file and regenerate its guides, which then follow flow lines; returns the `Placed` hair."""
    opened(path, is_applied)
    select(bpy.data.objects["Guides"])
    settings = {"guide_count": placed_hair.GUIDES, "length": 0.3 * seen().size, "gravity": 0.0}
    assert bpy.ops.vellus.distribute_guides(**settings) == {"FINISHED"}
    return seen()


@pytest.mark.parametrize("place", share_of(CHOSEN, 3))
def test_drawn_partings_part_the_same_strands(placed_files, place):
    applied, as_it_is = (
        (opened(placed_files(place), is_applied), draw("draw_parting", "Hair")) for is_applied in (True, False)
    )
    before, after = as_it_is
    assert np.linalg.norm(after.strands["Hair"][0] - before.strands["Hair"][0], axis=1).max() > 0.01 * before.size
    require_carried(applied[1], after, names=["Guides", "Hair"], points=1e-3)


@pytest.mark.parametrize("place", share_of(CHOSEN, 3))
def test_drawn_flow_turns_guides_the_same_way(placed_files, place):
    found = []
    for is_applied in (True, False):
        before = uncombed(placed_files(place), is_applied)
        found.append(draw("draw_flow", "Guides"))
    moved = np.linalg.norm(found[1].strands["Guides"][0] - before.strands["Guides"][0], axis=1)
    assert moved.max() > 0.05 * before.size
    require_carried(*found, names=["Guides"], points=0.02, lengths=0.01)  # roots are relaxed anew


# ------------------------------------------------------------------------------------------ points


@pytest.mark.parametrize("place", share_of(CHOSEN, 3))
def test_curls_need_the_same_points(placed_files, place):
    counts = []
    for is_applied in (False, True):
        opened(placed_files(place))
        hair, size = bpy.data.objects["Hair"], placed_hair.world_scale(bpy.data.objects["Body"])
        if is_applied:
            apply_transform()
        settings = style_items.group_of(hair.data.vellus.styles[0])
        settings.radius, settings.pitch = 0.005 * size, 0.02 * size
        select(hair)
        assert bpy.ops.vellus.use_points() == {"FINISHED"}
        counts.append(hair.data.vellus.hair.point_count)
        assert len(hair.data.points) == len(hair.data.curves) * counts[-1]
    assert abs(counts[0] - counts[1]) <= 1 and counts[0] > 41, counts


# ------------------------------------------------------------------------------------------ imports


def require_imported(before, made):
    """Assert that new objects have the hair and the guides of `Hair` in the world, with its widths."""
    after = seen()
    for kind, name in (("HAIR", "Hair"), ("GUIDES", "Guides")):
        (one,) = (o for o in made if o.type == "CURVES" and o.data.vellus.kind == kind)
        points, radii, _lengths = after.strands[one.name]
        wanted, its_radii, _lengths = before.strands[name]
        tolerance = 2e-6 * before.size + 1e-6 * abs(wanted).max()
        np.testing.assert_allclose(points, wanted, rtol=0.0, atol=tolerance, err_msg=name)
        if kind == "HAIR":
            np.testing.assert_allclose(radii, its_radii, rtol=1e-4, err_msg="widths")


@pytest.mark.parametrize(("ending", "place"), pairs([".usdc", ".abc"], reversed(CHOSEN), 3))
def test_imported_grooms_are_where_they_were(placed_files, tmp_path, place, ending):
    before, path = opened(placed_files(place)), tmp_path / f"groom{ending}"
    api.export_groom(path, [bpy.data.objects["Hair"]])
    known = set(bpy.data.objects)
    select(bpy.data.objects["Body"])
    assert bpy.ops.vellus.import_groom(filepath=str(path)) == {"FINISHED"}
    require_imported(before, set(bpy.data.objects) - known)


@pytest.mark.parametrize("place", share_of(["on a sheared rig", "small", "mirrored"], 3))
def test_hair_of_other_scenes_is_where_it_was(placed_files, place):
    before = opened(placed_files(place))
    known = set(bpy.data.objects)
    body = bpy.data.objects["Body"]
    found = api.import_curves(placed_files(place), body, name="Hair.001")  # as Blender names what it appends
    api.use_as_hair(found.curves, body, guides=found.guides)
    require_imported(before, set(bpy.data.objects) - known)
