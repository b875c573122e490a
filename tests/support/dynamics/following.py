# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on deforming surfaces: generation, and comparison with the surface."""

import bpy
import numpy as np

from hair_addon.blender.render import hair_cache
from tests.support.reading import attribute, evaluated_points, points


def update():
    bpy.context.view_layer.update()


def grow(surface, guide_count=40, strand_count=200, **settings):
    """Return (guides, hair) objects on a surface."""
    before = set(bpy.data.objects)
    bpy.context.view_layer.objects.active = surface
    # Unset values are fitted to the surface in its present pose, which may be bent.
    settings = {"length": 0.3, "gravity": 0.4} | settings
    bpy.ops.vellus.distribute_guides(guide_count=guide_count, **settings)
    guides = next(iter(set(bpy.data.objects) - before))
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count)
    return guides, next(iter(set(bpy.data.objects) - before - {guides}))


def surface_points(curves_object, surface=None):
    """Return the (S, 3) positions of the evaluated surface at the stored roots, in its local coordinates."""
    surface = (surface or curves_object.data.surface).evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = surface.to_mesh()
    mesh.calc_loop_triangles()
    triangles = np.array([triangle.vertices[:] for triangle in mesh.loop_triangles])
    vertices = np.array([vertex.co for vertex in mesh.vertices])
    surface.to_mesh_clear()
    corners = vertices[triangles[attribute(curves_object, "root_triangle")]]
    return np.einsum("sc,scx->sx", attribute(curves_object, "root_barycentric", 3), corners)


def drawn_points(curves_object):
    """Return the (S, P, 3) points that the viewport draws, in local coordinates."""
    return hair_cache.strands_on_gpu(curves_object.data).points


def assert_follows(*curves_objects):
    """Check that roots are on the surface, strands keep their lengths, and Cycles and the viewport agree."""
    for curves_object in curves_objects:
        found = evaluated_points(curves_object)
        np.testing.assert_allclose(found[:, 0], surface_points(curves_object), atol=1e-5)
        lengths, at_rest = (np.linalg.norm(np.diff(p, axis=1), axis=-1) for p in (found, points(curves_object)))
        np.testing.assert_allclose(lengths, at_rest, atol=1e-5)
        np.testing.assert_allclose(drawn_points(curves_object), found, atol=1e-5)
