# SPDX-License-Identifier: GPL-3.0-or-later
"""The door for strands: arrays ↔ Blender's Curves, with all that sculpt mode, hair nodes and renderers expect.

Curves are poly lines: 41 points are smooth as they are, every hair node group takes them, and Blender's own
evaluation of Catmull-Rom curves would cost more than making the strands.
"""

import bpy
import numpy as np

from ..core import mesh as mesh_math
from ..core.errors import HairError
from ..core.mesh import SurfacePoints

# How an attribute's values are called by its data type.
_VALUE_NAMES = {"FLOAT": "value", "INT": "value", "FLOAT2": "vector", "FLOAT_VECTOR": "vector"}

# A stored root further than this part of the surface's size from the curve's first point is out of date.
_ROOT_TOLERANCE = 1e-4


def _write_attribute(curves, name, data_type, domain, values):
    attribute = curves.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, domain):
        curves.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = curves.attributes.new(name, data_type, domain)
    scalar = np.int32 if data_type == "INT" else np.float32
    attribute.data.foreach_set(_VALUE_NAMES[data_type], np.ascontiguousarray(values, scalar).ravel())


def _read_attribute(curves, name, width):
    """(N, width) float32, or None where the attribute is missing."""
    attribute = curves.attributes.get(name)
    if attribute is None:
        return None
    values = np.empty((len(attribute.data), width), np.float32)
    attribute.data.foreach_get("vector" if width > 1 else "value", values.ravel())
    return values


def new_object(name, surface_object):
    """An empty Curves object on a surface, in the surface's collection."""
    if not surface_object.add_rest_position_attribute:
        # What Blender's own nodes find roots on a moving surface by. It counts as a change of the mesh: let Blender
        # take note of it before there is hair that would be made again for it.
        surface_object.add_rest_position_attribute = True
        bpy.context.view_layer.update()
    curves = bpy.data.hair_curves.new(name)
    curves.surface = surface_object
    curves_object = bpy.data.objects.new(name, curves)
    curves_object.parent = surface_object
    collections = surface_object.users_collection or (bpy.context.scene.collection,)
    collections[0].objects.link(curves_object)
    return curves_object


def draw_natively(curves, is_shown):
    """Let Blender draw Curves in viewports as they are, or as their bounding box: selectable, rendered, and cheap."""
    for user in bpy.data.objects:
        if user.data == curves:
            user.display_type = "TEXTURED" if is_shown else "BOUNDS"


def write_strands(curves, surface, points, roots, radii, guide_index):
    """Fill Curves with strands.

    points: (S, P, 3) float32 [m] in the surface's axes; roots: `SurfacePoints`; radii: (P,) [m];
    guide_index: (S,) int32, the guide that each strand follows first.
    """
    strand_count, point_count, _xyz = points.shape
    if strand_count == 0:
        raise ValueError("no strands: an empty list of curves would crash Blender")
    _resize(curves, strand_count, point_count)
    local = surface.to_local(points)
    scale = abs(np.linalg.det(surface.to_world_axes)) ** (1.0 / 3.0)
    stored_roots = surface.swap_winding(roots)
    normals = surface.to_local_normals(mesh_math.normals(surface.mesh, roots))
    _write_attribute(curves, "position", "FLOAT_VECTOR", "POINT", local)
    _write_attribute(curves, "rest_position", "FLOAT_VECTOR", "POINT", local)
    _write_attribute(curves, "radius", "FLOAT", "POINT", np.tile(radii / scale, strand_count))
    _write_attribute(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", surface.uvs(roots))
    _write_attribute(curves, "surface_normal", "FLOAT_VECTOR", "CURVE", normals)
    _write_attribute(curves, "guide_curve_index", "INT", "CURVE", guide_index)
    _write_attribute(curves, "id", "INT", "CURVE", np.arange(strand_count))
    _write_attribute(curves, "root_triangle", "INT", "CURVE", stored_roots.triangle)
    _write_attribute(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE", stored_roots.barycentric)
    curves.surface_uv_map = surface.uv_map
    curves.update_tag()


def _resize(curves, strand_count, point_count):
    if len(curves.curves) == strand_count and len(curves.points) == strand_count * point_count:
        sizes = point_counts(curves)
        if (sizes == point_count).all():
            return
    if len(curves.curves):
        curves.remove_curves()
    # Plain integers only.
    curves.add_curves([int(point_count)] * int(strand_count))
    curves.set_types(type="POLY")


def point_counts(curves):
    """(S,) int32: how many points each curve has."""
    offsets = np.zeros(len(curves.curves) + 1, np.int32)
    if len(curves.curves):
        curves.curve_offset_data.foreach_get("value", offsets)
    return np.diff(offsets)


def read_points(curves):
    """(all points, 3) float32 in local coordinates, curve after curve."""
    positions = np.empty((len(curves.points), 3), np.float32)
    if len(positions):
        curves.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions


def read_radii(curves):
    """(all points,) float32 in local units; Blender's own default where curves carry no radius."""
    radii = _read_attribute(curves, "radius", 1)
    return np.full(len(curves.points), 0.005, np.float32) if radii is None else radii[:, 0]


def is_combed(curves):
    """Whether points were moved, added or removed since `write_strands`."""
    written = _read_attribute(curves, "rest_position", 3)
    return written is not None and len(written) > 0 and not np.array_equal(written, read_points(curves))


def read_roots(curves, surface, first_points):
    """Where (S, 3) first points are rooted: as stored, or the nearest place where that is missing or stale.

    Curves that were added or slid in sculpt mode are stale, and so are all when the surface has other triangles.
    """
    stored = _stored_roots(curves, surface)
    if stored is None:
        return _nearest_roots(surface, first_points)
    distance = np.linalg.norm(mesh_math.positions(surface.mesh, stored) - first_points, axis=1)
    extent = np.ptp(surface.mesh.vertices, axis=0).max()
    stale = np.flatnonzero(~(distance <= _ROOT_TOLERANCE * extent))
    if len(stale):
        found = _nearest_roots(surface, first_points[stale])
        stored.triangle[stale] = found.triangle
        stored.barycentric[stale] = found.barycentric
    return stored


def _nearest_roots(surface, places):
    from ..core.surface_query import SurfaceQuery  # Warp takes longer to import than the add-on may take to start

    mesh_math.check_mesh(surface.mesh)
    return SurfaceQuery(surface.mesh).nearest(places)


def _stored_roots(curves, surface):
    """`SurfacePoints` from the curves' attributes; impossible ones become a corner of triangle 0. None if absent."""
    barycentric = _read_attribute(curves, "root_barycentric", 3)
    triangle_attribute = curves.attributes.get("root_triangle")
    if barycentric is None or triangle_attribute is None:
        return None
    triangle = np.empty(len(barycentric), np.int32)
    triangle_attribute.data.foreach_get("value", triangle)
    # Curves that sculpt mode adds carry zeros; a surface that lost faces leaves indices out of range.
    known = (abs(barycentric.sum(axis=1) - 1.0) < 1e-3) & (triangle >= 0) & (triangle < len(surface.mesh.triangles))
    triangle[~known] = 0
    barycentric[~known] = (1.0, 0.0, 0.0)
    return surface.swap_winding(SurfacePoints(triangle, barycentric))


def require_editable(datablock):
    """Raise `HairError` for linked data: Blender would accept the change and lose it on reload."""
    if datablock.library is not None:
        raise HairError(f'"{datablock.name}" is linked from another file: make a library override of it first.')
