# SPDX-License-Identifier: GPL-3.0-or-later
"""How far strands begin from the surface that they grow on, as Blender evaluates it; without the add-on's help.

Where a folded quad is bent further, Blender may cut it along its other diagonal. Roots stay on the triangle that they
grow on at rest: else they would jump from frame to frame. So a surface is what either cut makes of it.
"""

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

NEAR = 2e-3  # of a surface's size: a face of more than four corners has other cuts than the two of a quad


def should_be_rooted(curves_object):
    """Whether an object is hair that is up to date, without a complaint, on a surface that is not being edited.

    Hair that follows guides of another surface grows on that one, and its panel says so. Curves that became hair begin
    as far from the surface as they did, which they store. A linked duplicate stands on that of the surface. Of points
    that were deleted in Edit Mode some may be roots.
    """
    hair = curves_object.data
    guides, surface = hair.vellus.guide_curves, hair.surface
    if hair.vellus.kind != "HAIR" or not hair.vellus.is_live or not len(hair.curves):
        return False
    if guides is None or surface is None or any(one.vellus.status or one.vellus.is_stale for one in (hair, guides)):
        return False
    if guides.surface != surface or "root_distance" in hair.attributes or not _are_equal(hair):
        return False
    if (
        curves_object.parent is not None
        and curves_object.parent != surface
        and curves_object.parent.data == surface.data
    ):
        return False
    return bpy.context.view_layer.objects.get(surface.name) == surface and surface.mode == "OBJECT"


def _are_equal(curves):
    """Whether all curves have the same number of points."""
    offsets = np.empty(len(curves.curve_offset_data), np.int32)
    curves.curve_offset_data.foreach_get("value", offsets)
    return not np.ptp(np.diff(offsets))


def far_root(curves_object, strands, depsgraph):
    """What to say of the root that is furthest from the surface; "" where all are on it.

    strands: (S, P, 3) in the object's coordinates; a few of them are looked at.
    """
    surface = curves_object.data.surface.evaluated_get(depsgraph)
    to_world, place = surface.matrix_world, curves_object.evaluated_get(depsgraph).matrix_world
    if not len(surface.data.polygons) or abs(to_world.determinant()) < 1e-12:
        return ""
    corners = [to_world @ Vector(corner) for corner in surface.bound_box]
    size = max((a - b).length for a in corners for b in corners)
    most, cuts = 0.0, None
    for root in strands[:: max(len(strands) // 5, 1), 0]:
        root = place @ Vector(map(float, root))
        found, nearest, _normal, _face = surface.closest_point_on_mesh(to_world.inverted() @ root)
        away = (to_world @ nearest - root).length if found else 0.0
        if away > NEAR * size:
            cuts = cuts or _cut_both_ways(surface.data, to_world)
            away = min(away, cuts.find_nearest(root)[3])
        most = max(most, away)
    if most <= NEAR * size:
        return ""
    return f"a root of {curves_object.name} is {most:.3g} away from {surface.name}, which is {size:.3g} large"


def _cut_both_ways(mesh, to_world):
    """The tree of a mesh's triangles, with both cuts of each quad, in the world."""
    mesh.calc_loop_triangles()
    triangles = [tuple(triangle.vertices) for triangle in mesh.loop_triangles]
    for a, b, c, d in (face.vertices for face in mesh.polygons if len(face.vertices) == 4):
        triangles += [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
    return BVHTree.FromPolygons([to_world @ vertex.co for vertex in mesh.vertices], triangles)
