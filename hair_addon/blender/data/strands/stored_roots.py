# SPDX-License-Identifier: GPL-3.0-or-later
"""Stored roots of Curves: a triangle, its vertices, and barycentric coordinates.

The vertices locate a root in a face regardless of its triangulation. If modifiers subdivide the surface, roots that
were placed on its cage are stored exactly on the cage too, and strands begin there: their slide is the offset to the
root on the subdivided surface.
"""

import numpy as np

from ....core import geometry
from ....core.geometry.mesh import SurfacePoints
from . import attributes

VERTICES = ("root_vertex_0", "root_vertex_1", "root_vertex_2")
SLIDE = "root_slide"
_CAGE = ("cage_triangle", "cage_barycentric")


def points(curves, surface, is_complete=False):
    """`SurfacePoints` of roots on a surface with the faces that they were stored on; None if there are none.

    Invalid roots are replaced by a triangle's corner. is_complete: return None if any root is invalid.
    """
    return points_of(stored(curves), surface, is_complete)


def stored(curves):
    """Return the stored arrays that `points_of` takes: triangles, barycentric coordinates and vertices, each None if
    missing.
    """
    return *raw(curves), _vertices(curves)


def points_of(stored_arrays, surface, is_complete=False):
    """Return `points` from the arrays of `stored`, which are not modified."""
    triangle, barycentric, vertices = stored_arrays
    if barycentric is None or triangle is None or not len(surface.mesh.triangles):
        return None
    triangle, barycentric = triangle.copy(), barycentric.copy()
    # Curves that Sculpt Mode adds have zeros; on a surface that lost faces indices are out of range.
    known = are_barycentric(barycentric) & (triangle >= 0) & (triangle < len(surface.mesh.triangles))
    triangle[~known] = 0
    found = surface.swap_winding(SurfacePoints(triangle, barycentric))
    if vertices is not None:
        are_vertices = _all((vertices >= 0) & (vertices < len(surface.rest)))
        is_other = ~_all(vertices == surface.root_vertices(found))
        cut_otherwise = np.flatnonzero(known & is_other & are_vertices)
        known &= are_vertices
        if len(cut_otherwise):
            polygons = geometry.faces.face_places.owners(surface.triangulated)[triangle[cut_otherwise]]
            stored_places = vertices[cut_otherwise], barycentric[cut_otherwise]
            present, are_none = surface.points_at(polygons, *stored_places)
            found.triangle[cut_otherwise], found.barycentric[cut_otherwise] = present.triangle, present.barycentric
            known[cut_otherwise[are_none]] = False
    if is_complete and not known.all():
        return None
    found.triangle[~known] = 0
    found.barycentric[~known] = (1.0, 0.0, 0.0)
    return found


def write_cage(curves, surface, roots):
    """Store `SurfacePoints` on the `Surface.cage`; None removes stored points."""
    curves.vellus.cage_topology = "" if roots is None else surface.topology
    if roots is None:
        _remove(curves, *_CAGE)
        return
    stored = surface.swap_winding(roots)
    attributes.write(curves, _CAGE[0], "INT", "CURVE", stored.triangle)
    attributes.write(curves, _CAGE[1], "FLOAT_VECTOR", "CURVE", stored.barycentric)


def are_on_cage(curves, surface):
    """Whether roots on a `Surface.cage` are stored besides roots on the subdivided surface."""
    return curves.vellus.cage_topology != "" and curves.vellus.cage_topology == surface.topology


def cage_points(curves, surface, is_complete=True):
    """`SurfacePoints` on a `Surface.cage`, or None; invalid roots are handled as in `points`."""
    if curves.vellus.topology == surface.topology:
        return points(curves, surface, is_complete)
    if not are_on_cage(curves, surface):
        return None
    triangle = attributes.read(curves, _CAGE[0], "INT", "CURVE")
    barycentric = attributes.read(curves, _CAGE[1], "FLOAT_VECTOR", "CURVE")
    if triangle is None or barycentric is None:
        return None
    known = are_barycentric(barycentric) & (triangle >= 0) & (triangle < len(surface.mesh.triangles))
    if is_complete and not known.all():
        return None
    triangle[~known], barycentric[~known] = 0, (1.0, 0.0, 0.0)
    return surface.swap_winding(SurfacePoints(triangle, barycentric))


def write_slides(curves, slides):
    """Store (S, 3) offsets from first points to roots on the surface at rest; None: strands begin at their roots."""
    if slides is None or not slides.any():
        _remove(curves, SLIDE)
    else:
        attributes.write(curves, SLIDE, "FLOAT_VECTOR", "CURVE", slides)


def slides(curves):
    """Return the (S, 3) float32 slides stored by `write_slides`, or None."""
    return attributes.read(curves, SLIDE, "FLOAT_VECTOR", "CURVE")


def slid_places(curves):
    """`places` on a mesh of any size, followed by the slides if strands have any, for `Pose.rooted`."""
    found, stored = places(curves, np.inf), slides(curves)
    return found if found is None or stored is None else (*found, stored)


def _remove(curves, *names):
    for name in names:
        if name in curves.attributes:
            curves.attributes.remove(curves.attributes[name])


def raw(curves):
    """Stored (S,) int32 triangles and (S, 3) float32 barycentric coordinates, each None if missing."""
    triangle = attributes.read(curves, "root_triangle", "INT", "CURVE")
    return triangle, attributes.read(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE")


def places(curves, vertex_count):
    """Stored (S, 3) int32 root vertices and (S, 3) float32 barycentric coordinates in Blender's order; or None.

    Rows that are invalid for a mesh with `vertex_count` vertices are zero.
    """
    barycentric, vertices = attributes.read(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE"), _vertices(curves)
    if barycentric is None or vertices is None:
        return None
    is_lost = ~are_barycentric(barycentric) | (vertices < 0).any(axis=1) | (vertices >= vertex_count).any(axis=1)
    vertices[is_lost], barycentric[is_lost] = 0, 0.0
    return vertices, barycentric


def turn(curves, turned):
    """Flip the triangles of stored roots, as Blender flips faces when it applies a mirroring scale.

    turned: the `FlippedFaces` of the surface.
    """
    vertices, barycentric = _vertices(curves), attributes.read(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE")
    if vertices is None or barycentric is None:
        return
    if turned.vertices is not None:
        are_vertices = (vertices >= 0) & (vertices < len(turned.vertices))
        vertices[are_vertices] = turned.vertices[vertices[are_vertices]]
    attributes.write(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE", barycentric[:, [0, 2, 1]])
    on_cage = attributes.read(curves, _CAGE[1], "FLOAT_VECTOR", "CURVE")
    if on_cage is not None:
        attributes.write(curves, _CAGE[1], "FLOAT_VECTOR", "CURVE", on_cage[:, [0, 2, 1]])
    for name, column in zip(VERTICES, (0, 2, 1), strict=True):
        attributes.write(curves, name, "INT", "CURVE", vertices[:, column])


def may_start_off_surface(curves):
    """Whether strands may begin off their surface, as imported curves do."""
    return attributes.has(curves, "root_distance", "FLOAT", "CURVE")


def are_barycentric(coordinates):
    """Return (S,) bool: whether rows of (S, 3) are inside a triangle up to rounding; False for NaN."""
    is_inside = _all((coordinates >= -1e-3) & (coordinates <= 1.0 + 1e-3))
    with np.errstate(over="ignore", invalid="ignore"):
        first, second, third = coordinates.T
        return is_inside & (abs(first + second + third - 1.0) < 1e-3)


def _all(truths):
    """Return (S,) bool: whether all of (S, 3) are true. NumPy's reduction along short rows takes ten times as long."""
    first, second, third = truths.T
    return first & second & third


def _vertices(curves):
    """Return (S, 3) int32 root vertices in Blender's order of corners; None if they are not stored."""
    corners = [attributes.read(curves, name, "INT", "CURVE") for name in VERTICES]
    return None if any(corner is None for corner in corners) else np.stack(corners, axis=1)
