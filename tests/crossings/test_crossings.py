# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations of features that work alone: a window and deformed surfaces, Edit Mode and settings.

Each of these ended Blender: a kernel read past the end of an array.
"""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import hair_cache
from tests.support.dynamics.following import assert_follows
from tests.support.pairs import pairs
from tests.support.reading import points, write_points


@pytest.fixture(autouse=True)
def no_traceback(capsys):
    """Fail on exceptions in handlers, which Blender prints before it continues."""
    yield
    reported = capsys.readouterr().err
    assert "Traceback" not in reported, reported


def update():
    bpy.context.view_layer.update()


DEFORMERS = {
    "subdivision": lambda sphere: sphere.modifiers.new("Subdivision", "SUBSURF"),
    "simple deform": lambda sphere: setattr(sphere.modifiers.new("Bend", "SIMPLE_DEFORM"), "angle", 1.0),
    "shape key": lambda sphere: add_shape_key(sphere),
}


def add_shape_key(sphere):
    sphere.shape_key_add(name="Basis")
    key = sphere.shape_key_add(name="Stretched")
    for place in key.points:
        place.co *= 1.5
    key.value = 1.0


def drawn(hair):
    """Return (S, P, 3), the points that the viewport draws."""
    return hair_cache.strands_on_gpu(hair.data).points


@pytest.mark.parametrize(("deformer", "strand_count"), pairs(DEFORMERS, [40_000, 20], 4))
def test_another_strand_count_on_a_deformed_surface(sphere, in_window, deformer, strand_count):
    """With another strand count on a deformed surface, the picture shows the strands to be written, at their own
    roots.
    """
    DEFORMERS[deformer](sphere)
    bpy.ops.vellus.add_hair(guide_count=40, strand_count=600, length=0.4)
    hair = bpy.data.objects["Hair"]
    update()
    assert len(drawn(hair)) == 600
    hair.data.vellus.hair.strand_count = strand_count
    update()
    assert len(hair.data.curves) == 600, "the Curves were written before the picture was drawn"
    ahead = drawn(hair).copy()
    live_hair.write_all()
    update()
    assert len(ahead) == len(hair.data.curves) == strand_count
    invalidation.clear()
    np.testing.assert_allclose(ahead, drawn(hair), atol=1e-6)
    assert_follows(hair)


def test_a_picture_between_writing_and_blenders_report(sphere, in_window):
    """A picture between writing and Blender's report, as a script may draw it, shows the written strands."""
    DEFORMERS["simple deform"](sphere)
    bpy.ops.vellus.add_hair(guide_count=40, strand_count=300, length=0.4)
    hair = bpy.data.objects["Hair"]
    bpy.context.view_layer.objects.active = hair
    drawn(hair)
    bpy.ops.vellus.interpolate_hair(strand_count=4000)
    assert len(drawn(hair)) == 4000


def empty(curves_object):
    """Select all in Edit Mode, and delete it."""
    bpy.context.view_layer.objects.active = curves_object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curves.select_all(action="SELECT")
    bpy.ops.curves.delete()
    bpy.ops.object.mode_set(mode="OBJECT")
    update()
    assert len(curves_object.data.curves) == 0


def change_guide_length(guides, _hair):
    guides.data.vellus.guides.length = 0.7


def comb(guides, _hair):
    combed = points(guides)
    combed[:, 1:] += np.float32([0.0, 0.0, 0.1])
    write_points(guides, combed)


def change_radius(_guides, hair):
    hair.data.vellus.hair.radius = 0.01


def change_strand_count(_guides, hair):
    hair.data.vellus.hair.strand_count = 700


def edit_mesh(guides, _hair):
    mesh = guides.data.surface.data
    for vertex in mesh.vertices:
        vertex.co *= 1.1
    mesh.update()


CHANGES = [change_guide_length, comb, change_radius, change_strand_count, edit_mesh]


@pytest.mark.parametrize(("change", "is_reloaded"), pairs(CHANGES, [False, True], 2))
@pytest.mark.parametrize("is_window", [False, True])
def test_emptied_hair_is_kept_after_changes(hair, monkeypatch, tmp_path, change, is_window, is_reloaded):
    """Emptied hair stays empty after changes, as edited by hand with a message, and the operator of its button grows
    it again.
    """
    monkeypatch.setattr(running, "has_window", lambda: is_window)
    empty(hair)
    if is_reloaded:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "emptied.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "emptied.blend"))
    guides, hair = bpy.data.objects["Guides"], bpy.data.objects["Hair"]
    change(guides, hair)
    update()
    live_hair.write_all()
    assert len(hair.data.curves) == 0
    assert hair.data.vellus.status.startswith("Hand-edited")
    assert bindings.of(hair.data) is None
    wanted = hair.data.vellus.hair.strand_count
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.interpolate_hair(strand_count=wanted) == {"FINISHED"}
    assert len(hair.data.curves) == wanted
    assert hair.data.vellus.status == ""


@pytest.mark.parametrize("change", CHANGES)
def test_emptied_guides_are_kept_after_changes(hair, change):
    guides = bpy.data.objects["Guides"]
    before = points(hair)
    empty(guides)
    if change is not comb:
        change(guides, hair)
    update()
    assert len(guides.data.curves) == 0
    if change is not edit_mesh:
        np.testing.assert_array_equal(points(hair), before)
    bpy.context.view_layer.objects.active = guides
    assert bpy.ops.vellus.distribute_guides(guide_count=30) == {"FINISHED"}
    assert len(guides.data.curves) == 30


def test_a_part_of_the_strands_is_grown_again_as_a_whole(hair):
    """Deleted strands are back after the operator runs again with the same settings."""
    before = points(hair)
    bpy.context.view_layer.objects.active = hair
    hair.data.remove_curves(indices=list(range(100)))
    hair.data.update_tag()
    update()
    settings = hair.data.vellus.hair
    bpy.ops.vellus.interpolate_hair(strand_count=settings.strand_count, radius=settings.radius)
    np.testing.assert_array_equal(points(hair), before)
