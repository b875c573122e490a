# SPDX-License-Identifier: GPL-3.0-or-later
"""How far strands begin from the surface that they grow on, as Blender evaluates it; without the add-on's help."""

import bpy
from mathutils import Vector

NEAR = 2e-3  # of a surface's size: its faces are cut into triangles, which quads are not


def should_be_rooted(curves_object):
    """Whether an object is hair that is up to date, without a complaint, on a surface that is not being edited."""
    hair = curves_object.data
    guides, surface = hair.vellus.guide_curves, hair.surface
    if hair.vellus.kind != "HAIR" or not hair.vellus.is_live or not len(hair.curves):
        return False
    if guides is None or surface is None or any(one.vellus.status or one.vellus.is_stale for one in (hair, guides)):
        return False
    return bpy.context.view_layer.objects.get(surface.name) == surface and surface.mode == "OBJECT"


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
    most = 0.0
    for root in strands[:: max(len(strands) // 5, 1), 0]:
        root = place @ Vector(map(float, root))
        found, nearest, _normal, _face = surface.closest_point_on_mesh(to_world.inverted() @ root)
        most = max(most, (to_world @ nearest - root).length if found else 0.0)
    if most <= NEAR * size:
        return ""
    return f"a root of {curves_object.name} is {most:.3g} away from {surface.name}, which is {size:.3g} large"
