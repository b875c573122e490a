# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves attached to another surface keep their positions, widths and lengths in the world."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests.support import placed_hair
from tests.support.exchange.imported import curves_object, select
from tests.support.pairs import pairs
from tests.support.placed_hair import PLACES, require_carried, seen
from tests.support.reading import points

COMBED = ("Guides", "Kept", "Made")


@pytest.fixture(scope="module")
def placed_file(blender, tmp_path_factory):
    """Save a file with hair on a turned surface that a modifier bends."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bend = placed_hair.grow("turned").modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.angle = "BEND", 0.5
    path = str(tmp_path_factory.mktemp("placed") / "placed.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    return path


def attach_all(other, is_picked):
    """Attach all hair to a mesh that is selected, or was picked in the panel before."""
    for name in COMBED:
        select(*([] if is_picked else [other]), bpy.data.objects[name])
        if is_picked:
            bpy.data.objects[name].data.surface = other
            bpy.context.view_layer.update()
        assert bpy.ops.vellus.attach_to_surface() == {"FINISHED"}


def stand(place):
    """Add a mesh with the body's visible shape in the world, whose object is at one of `PLACES`."""
    body = bpy.data.objects["Body"]
    mesh = bpy.data.meshes.new_from_object(body.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    other = bpy.data.objects.new("Other", mesh)
    bpy.context.collection.objects.link(other)
    PLACES[place](other)
    bpy.context.view_layer.update()
    mesh.transform(other.matrix_world.inverted() @ body.matrix_world)
    bpy.context.view_layer.update()
    return other


@pytest.mark.parametrize("is_picked", [False, True], ids=["selected", "picked"])
@pytest.mark.parametrize(("is_deleted", "place"), pairs([False, True], PLACES, 5))
def test_attached_hair_stays_where_it_is(placed_file, place, is_deleted, is_picked):
    bpy.ops.wm.read_homefile(filepath=placed_file)
    if is_deleted:
        bpy.data.objects["Body"].modifiers.clear()  # where it carried hair is gone with it
    before = seen()
    other = stand(place)
    if is_deleted:
        bpy.data.objects.remove(bpy.data.objects["Body"])
        bpy.context.view_layer.update()
    attach_all(other, is_picked)
    after = seen("Other")
    require_carried(before, after, names=COMBED)
    for name in COMBED:
        attached = bpy.data.objects[name]
        assert attached.parent == attached.data.surface == other and attached.data.vellus.status == ""
    roots = bpy.data.objects["Hair"].data
    assert len(roots.curves) == placed_hair.STRANDS and roots.vellus.status == ""


@pytest.mark.parametrize("is_reopened", [False, True])
def test_hair_without_a_parent_follows_a_surface_that_is_renamed(placed_file, tmp_path, is_reopened):
    """Hair without a parent follows its surface when the surface is renamed, which picks no other surface."""
    bpy.ops.wm.read_homefile(filepath=placed_file)
    for name in ("Guides", "Kept"):
        bpy.data.objects[name].parent = None
    bpy.data.objects["Body"].name = "Head"
    bpy.context.view_layer.update()
    if is_reopened:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "renamed.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "renamed.blend"))
    before = {name: points(bpy.data.objects[name]) for name in ("Guides", "Kept")}
    mesh = bpy.data.objects["Head"].data
    mesh.transform(Matrix.Translation((0.0, 0.3, 0.2)))
    mesh.vertices[0].co.x += 1e-3  # no transform that was applied
    mesh.update()
    bpy.context.view_layer.update()
    for name, stood in before.items():
        moved = points(bpy.data.objects[name])[:, 0]
        np.testing.assert_allclose(moved, stood[:, 0] + [0.0, 0.3, 0.2], atol=2e-3)
        assert bpy.data.objects[name].data.vellus.status == ""


def test_hair_far_from_a_mesh_is_not_attached_to_it(placed_file):
    bpy.ops.wm.read_homefile(filepath=placed_file)
    before = seen()
    other = stand("moved")
    other.location.x += 50.0
    bpy.context.view_layer.update()
    select(other, bpy.data.objects["Guides"])
    with pytest.raises(RuntimeError, match="too far from"):
        bpy.ops.vellus.attach_to_surface()
    require_carried(before, seen())


@pytest.mark.parametrize("use", ["use_as_hair", "use_as_guides"])
@pytest.mark.parametrize(
    ("own_scale", "place"), pairs([(0.01, 0.01, 0.01), (1.0, 1.0, 1.0), (-50.0, 100.0, 80.0)], PLACES, 5), ids=str
)
def test_used_curves_keep_their_places_and_widths(placed_file, place, own_scale, use):
    bpy.ops.wm.read_homefile(filepath=placed_file)
    other = stand(place)
    own = curves_object([line / np.float32(own_scale) for line in placed_hair.outward(other, 12)], "Own")
    own.data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(len(own.data.points), 2e-4))
    own.scale = own_scale
    before = seen("Other")
    select(other, own)
    options = {"grows_hair": False} if use == "use_as_guides" else {}
    assert getattr(bpy.ops.vellus, use)(**options) == {"FINISHED"}
    assert own.data.surface == other
    require_carried(before, seen("Other"), names=["Own"])
