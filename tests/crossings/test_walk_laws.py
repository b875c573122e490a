# SPDX-License-Identifier: GPL-3.0-or-later
"""The laws of the random walks: each accepts valid hair, and detects faults."""

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon.blender.groom.selection import parts_of
from hair_addon.blender.groom.systems import diagnostics
from hair_addon.blender.render import hair_cache
from tests.support import rooted
from tests.support.reading import points, write_points
from tests.support.walk import walk_lengths
from tests.support.walk.walk_operations import Artist
from tests.support.walk.walk_painting import PaintingSteps

QUAD = [(1.0, 0.0, 0.2), (1.0, 1.0, 0.0), (0.0, 1.0, 0.2), (0.0, 0.0, 0.0)]
INWARD = (0.6, 0.6, 0.0)  # where the last corner goes, so that Blender cuts the quad along its other diagonal


def cuts(mesh):
    mesh.calc_loop_triangles()
    return {tuple(sorted(triangle.vertices)) for triangle in mesh.loop_triangles}


def far(curves_object, lifted=0.0):
    strands = hair_cache.strands_on_gpu(curves_object.data).points + np.float32((0.0, 0.0, lifted))
    return rooted.far_root(curves_object, strands, bpy.context.evaluated_depsgraph_get())


@pytest.fixture
def folded(scene):
    """Return hair on a folded quad, whose shape key makes Blender divide it differently."""
    mesh = bpy.data.meshes.new("Folded")
    mesh.from_pydata(QUAD, [], [(0, 1, 2, 3)])
    surface = bpy.data.objects.new("Folded", mesh)
    bpy.context.scene.collection.objects.link(surface)
    bpy.context.view_layer.objects.active = surface
    surface.shape_key_add(name="Basis")
    inward = surface.shape_key_add(name="Inward")
    inward.points[3].co, inward.value = INWARD, 0.0
    bpy.context.view_layer.update()
    bpy.ops.vellus.add_hair(guide_count=6, strand_count=40, relax_iterations=2, length=0.1)
    return next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")


def test_roots_stay_on_the_triangles_of_a_folded_quad(folded):
    surface = folded.data.surface
    at_rest = cuts(surface.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)
    assert rooted.should_be_rooted(folded) and not far(folded)
    surface.data.shape_keys.key_blocks["Inward"].value = 1.0
    bpy.context.view_layer.update()
    posed = surface.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert cuts(posed.data) != at_rest
    roots = hair_cache.strands_on_gpu(folded.data).points[:, 0]
    away = [(posed.closest_point_on_mesh(root)[1] - Vector(root)).length for root in roots.tolist()]
    assert max(away) > 10.0 * rooted.NEAR  # from the surface as Blender cuts it there
    assert not far(folded)
    assert far(folded, lifted=0.05).startswith("a root of Hair is 0.0")


def test_hair_that_follows_guides_of_another_surface_is_not_asked_for_but_told(hair):
    assert rooted.should_be_rooted(hair) and not far(hair)
    assert far(hair, lifted=0.1)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
    bpy.ops.vellus.distribute_guides(guide_count=12, relax_iterations=1)
    own = hair.data.vellus.guide_curves
    others = next(c for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES" and c != own)
    hair.data.vellus.guide_curves = others
    bpy.context.view_layer.update()
    assert not hair.data.vellus.status and not hair.data.vellus.is_stale
    assert far(hair) and not rooted.should_be_rooted(hair)
    told = [warning.text for warning in diagnostics.warnings_of(hair.data.surface, parts_of(hair))]
    assert any("give it guides of its own" in text for text in told), told


def test_curves_that_became_hair_begin_where_they_did(hair):
    """Curves that became hair begin as far off the surface as they store."""
    strands = points(hair) + np.float32((0.0, 0.0, 0.3))
    write_points(hair, strands)
    hair.data.vellus.kind = "NONE"
    bpy.ops.vellus.use_as_hair(guide_count=4)
    assert hair.data.vellus.kind == "HAIR" and far(hair) and not rooted.should_be_rooted(hair)


def test_roots_that_were_deleted_are_not_asked_for(hair):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curves.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = np.zeros(len(hair.data.points), bool)
    chosen[0] = True
    hair.data.attributes[".selection"].data.foreach_set("value", chosen)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curves.delete()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(hair.data.points) == len(chosen) - 1
    assert not rooted.should_be_rooted(hair)


def test_what_the_walk_paints_is_there_after_undo_and_redo(hair):
    """Pixels that the walk paints are restored by undo and redo, which Blender does only for images stored in the
    file.
    """
    bpy.ops.ed.undo_push(message="before")
    walking = Artist.__new__(Artist)
    PaintingSteps.paint_image(walking, number=1, of="hair", brightness=1.0)
    bpy.ops.ed.undo()
    assert "Painted" not in bpy.data.images
    bpy.ops.ed.redo()
    assert list(bpy.data.images["Painted"].pixels) == [1.0] * 64


def test_a_strand_that_is_longer_is_reported(hair):
    with walk_lengths.are_kept(("HAIR",)):
        hair.rotation_euler.z += 0.3
    combed = points(hair)
    combed[3, -1] += 0.01
    with pytest.raises(AssertionError, match="longer or shorter"), walk_lengths.are_kept(("HAIR",)):
        write_points(hair, combed)
        hair.data.vellus.status = ""  # of hair that is edited by hand
