# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances of roots from the evaluated surface, computed independently of the add-on.

If a folded quad is bent further, Blender may split it along its other diagonal. Roots stay on the triangle on which
they grow at rest, as they would jump between frames otherwise. So the surface consists of both triangulations.
"""

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

NEAR = 2e-3  # fraction of a surface's size: faces with more than four corners have more triangulations than quads


def should_be_rooted(curves_object):
    """Whether an object is up-to-date hair without errors, on a surface that is not being edited.

    Hair with guides of another surface grows on that surface, and its panel reports it. Curves that became hair keep
    their distance from the surface, which they store. A linked duplicate is on a duplicate of the surface. Points
    deleted in Edit Mode may be roots.
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
    """Return a message about the root farthest from the surface; "" if all are on it.

    strands: (S, P, 3) in the object's coordinates; only some of them are checked.
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
    """Return the tree of a mesh's triangles in the world, with both triangulations of each quad."""
    mesh.calc_loop_triangles()
    triangles = [tuple(triangle.vertices) for triangle in mesh.loop_triangles]
    for a, b, c, d in (face.vertices for face in mesh.polygons if len(face.vertices) == 4):
        triangles += [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
    return BVHTree.FromPolygons([to_world @ vertex.co for vertex in mesh.vertices], triangles)
