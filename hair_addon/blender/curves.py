# SPDX-License-Identifier: GPL-3.0-or-later
"""The door for strands: arrays ↔ Blender's Curves, with all that sculpt mode, hair nodes and renderers expect.

Curves are poly lines: 41 points are smooth as they are, every hair node group takes them, and Blender's own
evaluation of Catmull-Rom curves would cost more than making the strands.
"""

import bpy
import numpy as np
from mathutils import Matrix

from ..core import mesh as mesh_math
from ..core import strands
from ..core.errors import HairError
from ..core.mesh import SurfacePoints
from . import attributes, follow_nodes

_GUIDE_MAP = ("guide_index", "guide_weight")

# A stored root further than this part of the surface's size from the curve's first point is out of date.
_ROOT_TOLERANCE = 1e-4


def _write_positions(curves, points):
    """Points (..., 3) float32 of all curves, and what `is_combed` knows them by again."""
    from ..core.fingerprint import fingerprint  # Warp takes longer to import than the add-on may take to start

    curves.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(points, np.float32).ravel())
    curves.vellus.written = fingerprint(points)


def _write_radii(curves, radii):
    """The same radii (P,) along every strand, unless they are there already."""
    radii, present = np.asarray(radii, np.float32), attributes.read(curves, "radius", 1)
    if present is not None and _repeats(present.ravel(), radii):
        return
    attributes.write(curves, "radius", "FLOAT", "POINT", np.tile(radii, len(curves.curves)))


def _repeats(values, row):
    """Whether values (N,) are a row over and over again; looked at in parts that the processor's caches hold."""
    some = np.tile(row, 4096)
    parts = (values[first : first + len(some)] for first in range(0, len(values), len(some)))
    return all(np.array_equal(part, some[: len(part)]) for part in parts)


_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


def new_object(name, surface_object, is_rendered=True):
    """An empty Curves object on a surface, in the surface's collection."""
    curves = bpy.data.hair_curves.new(name)
    curves.surface = surface_object
    return link_object(name, curves, surface_object, is_rendered)


def link_object(name, curves, surface_object, is_rendered=True):
    """A new object for Curves, a child of their surface and in its collection.

    is_rendered: whether Cycles and EEVEE show it. By rays: what renders leave out as a whole, exporters do too.
    """
    curves_object = bpy.data.objects.new(name, curves)
    curves_object.parent = surface_object
    for ray in _RAYS:
        setattr(curves_object, f"visible_{ray}", is_rendered)
    collections = surface_object.users_collection or (bpy.context.scene.collection,)
    collections[0].objects.link(curves_object)
    follow_nodes.add_modifier(curves_object)
    return curves_object


def keep_rest(surface_object):
    """Let Blender hand out where a surface's vertices are before it deforms: what strands are rooted on."""
    if not surface_object.add_rest_position_attribute:
        surface_object.add_rest_position_attribute = True
        # It counts as a change of the mesh: let Blender take note of it before there is hair that would follow it.
        bpy.context.view_layer.update()


def draw_natively(curves, is_shown):
    """Let Blender draw Curves in viewports as they are, or not at all. Renders show them either way."""
    for user in bpy.data.objects:
        if user.data == curves:
            user.display_type = "TEXTURED" if is_shown else _hidden_as(user)


def show_selection(curves_object):
    """Draw a box around an object that Blender does not draw otherwise while it is selected, and none when it isn't."""
    hidden_as = _hidden_as(curves_object)
    if curves_object.display_type in {"WIRE", "BOUNDS"} and curves_object.display_type != hidden_as:
        curves_object.display_type = hidden_as


def _hidden_as(curves_object):
    """The display for which Blender evaluates, uploads and draws no strand.

    Of Curves as wire it draws nothing, until they are selected: then it draws the outline of every strand. Of those
    that are displayed as a box it draws that box instead.
    """
    return "BOUNDS" if curves_object.select_get() else "WIRE"


def make_strands(curves, surface, roots, radii, identities, *, leaders=None, normals=None, written_radii=None):
    """Make room for strands, and write all of them but where their points are.

    roots: `SurfacePoints` (S,); radii: (P,) in local coordinates; identities: as `Surface.identities` gives them;
    leaders: (S,) int32, the strand that stands for the guide of each, or None where strands are guides themselves;
    normals: (S, 3) float32 of the surface at the roots, if they are known; written_radii: (P,) that the curves have, if
    they are known.
    """
    if len(roots) == 0:
        raise ValueError("no strands: an empty list of curves would crash Blender")
    is_new = _resize(curves, len(roots), len(radii))
    if is_new or "radius" not in curves.attributes or not np.array_equal(radii, written_radii):
        _write_radii(curves, radii)
    if leaders is not None:
        # Blender's hair nodes look for this curve among the strands themselves: around it they clump, curl and braid.
        attributes.write(curves, "guide_curve_index", "INT", "CURVE", leaders)
    for name, data_type, values in zip(("id", "strand_random"), ("INT", "FLOAT"), identities, strict=True):
        attributes.write(curves, name, data_type, "CURVE", values)
    write_roots(curves, surface, roots, normals)


def write_guide_map(curves, guide_map):
    """Store (S, k) int32 guides of strands and (S, k) float32 weights, a pair of attributes for each k; None: remove.

    guide_index_0 and guide_weight_0 are the nearest's.
    """
    slot_count = 0 if guide_map is None else guide_map[0].shape[1]
    for attribute in list(curves.attributes):
        kind, _, slot = attribute.name.rpartition("_")
        if kind in _GUIDE_MAP and slot.isdecimal() and int(slot) >= slot_count:
            curves.attributes.remove(attribute)
    for slot in range(slot_count):
        for name, data_type, values in zip(_GUIDE_MAP, ("INT", "FLOAT"), guide_map, strict=True):
            attributes.write(curves, f"{name}_{slot}", data_type, "CURVE", values[:, slot])


def read_guide_map(curves):
    """(S, k) int32 and (S, k) float32 of `write_guide_map`, or None where there is none."""
    slots = [slot for slot in range(len(curves.attributes)) if f"{_GUIDE_MAP[0]}_{slot}" in curves.attributes]
    if not slots:
        return None
    indices = np.empty((len(slots), len(curves.curves)), np.int32)
    weights = np.empty(indices.shape, np.float32)
    for slot in slots:
        for name, values in zip(_GUIDE_MAP, (indices, weights), strict=True):
            curves.attributes[f"{name}_{slot}"].data.foreach_get("value", values[slot])
    return np.ascontiguousarray(indices.T), np.ascontiguousarray(weights.T)


def write_roots(curves, surface, roots, normals=None):
    """Store where strands are rooted: for ourselves, for the nodes that carry them, and for Blender's own tools."""
    stored = surface.swap_winding(roots)
    normals = surface.to_local_normals(mesh_math.normals(surface.mesh, roots) if normals is None else normals)
    attributes.write(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", surface.uvs(roots))
    attributes.write(curves, "surface_normal", "FLOAT_VECTOR", "CURVE", normals)
    attributes.write(curves, "root_triangle", "INT", "CURVE", stored.triangle)
    attributes.write(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE", stored.barycentric)
    for name, vertices in zip(follow_nodes.ROOT_VERTICES, surface.root_vertices(roots).T, strict=True):
        attributes.write(curves, name, "INT", "CURVE", vertices)
    curves.surface_uv_map = surface.uv_map
    curves.vellus.topology = surface.topology
    for user in bpy.data.objects:
        if user.data == curves and user.library is None:
            is_combed = curves.vellus.kind == "GUIDES" and surface.corner_uvs is not None
            follow_nodes.set_surface(user, curves.surface, len(surface.rest), is_combed)
    curves.update_tag()


def write_uvs(curves, surface):
    """Tell Curves the UV coordinates of their roots, and nothing else."""
    counts = point_counts(curves)
    if not len(counts):
        return
    firsts = np.concatenate([[0], np.cumsum(counts)])[:-1]
    roots = read_roots(curves, surface, surface.from_local(read_points(curves)[firsts]))
    attributes.write(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", surface.uvs(roots))
    curves.surface_uv_map = surface.uv_map
    curves.update_tag()


def write_points(curves, growing):
    """Put strands that `make_strands` made where they are; growing: a future of local (S, P, 3) float32."""
    # Who reaches for a point has Blender copy what it shares with its last evaluation, half of what writing takes: it
    # may do so while strands grow.
    _ = curves.attributes["position"].data[0]
    _write_positions(curves, growing.result())
    curves.update_tag()


# The name of the property that says where a surface was when guides were rooted on it. In a group: of a bare array
# Blender's USD exporter says that it does not know what to do with it.
_STOOD_ON = "vellus_stood_on"


def keep_surface(curves, surface):
    """Remember where the surface's vertices rest: what guides are carried from when somebody edits it."""
    if _STOOD_ON in curves:
        # Blender 5.2 writes an array over a shorter one, past its end.
        del curves[_STOOD_ON]
    curves[_STOOD_ON] = {"rest": surface.rest.ravel()}


def stood_on(curves):
    """(V, 3) float32 that `keep_surface` remembered, or None."""
    kept = curves.get(_STOOD_ON)
    return None if kept is None else np.array(kept["rest"], np.float32).reshape(-1, 3)


def carry(curves, motion):
    """Move strands with their surface's `SurfaceMotion`."""
    from ..core import surface_frames  # Warp takes longer to import than the add-on may take to start

    roots, counts, was_combed = read_root_places(curves), point_counts(curves), is_combed(curves)
    points = read_points(curves)
    if (counts == counts[0]).all():
        points = surface_frames.carry(points.reshape(len(counts), -1, 3), motion, *roots)
    else:  # each point as a strand of its own
        points = surface_frames.carry(points[:, None], motion, *(np.repeat(part, counts, axis=0) for part in roots))
    _write_moved(curves, points, was_combed)


def _write_moved(curves, points, was_combed):
    """Positions of strands that went where their surface went: combed ones stay combed."""
    before = curves.vellus.written
    _write_positions(curves, points)
    if was_combed:
        curves.vellus.written = before


def transform(curves, matrix):
    """Multiply all points by a (3, 3) matrix.

    So that strands stay where they are in the world when the opposite was applied to their surface, whose child they
    are: what Blender has put between parent and child to keep the child in place is taken away again.
    """
    if len(curves.points):
        _write_moved(curves, read_points(curves) @ matrix.T, is_combed(curves))
    for user in bpy.data.objects:
        if user.data == curves and user.parent == curves.surface:
            user.matrix_local = Matrix()


def read_root_places(curves):
    """Stored (S, 3) int32 root vertices and (S, 3) float32 barycentric coordinates in Blender's order; or None."""
    barycentric = attributes.read(curves, "root_barycentric", 3)
    corners = [curves.attributes.get(name) for name in follow_nodes.ROOT_VERTICES]
    if barycentric is None or None in corners:
        return None
    vertices = np.empty((3, len(barycentric)), np.int32)
    for row, corner in zip(vertices, corners, strict=True):
        corner.data.foreach_get("value", row)
    return np.ascontiguousarray(vertices.T), barycentric


def _resize(curves, strand_count, point_count):
    """Make room for strands; whether there was none, so that nothing is known of any."""
    if len(curves.curves) == strand_count and len(curves.points) == strand_count * point_count:
        sizes = point_counts(curves)
        if (sizes == point_count).all():
            return False
    if len(curves.curves):
        curves.remove_curves()
    # Plain integers only.
    curves.add_curves([int(point_count)] * int(strand_count))
    curves.set_types(type="POLY")
    return True


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
    radii = attributes.read(curves, "radius", 1)
    return np.full(len(curves.points), 0.005, np.float32) if radii is None else radii[:, 0]


def read_randoms(curves):
    """(S,) float32 in [0, 1]: by which strands differ; numbers follow from the order of curves that carry none."""
    if not _has_randoms(curves):
        return strands.random_numbers(len(curves.curves))
    randoms = attributes.read(curves, "strand_random", 1)[:, 0]
    return np.where((randoms >= 0.0) & (randoms <= 1.0), randoms, np.float32(0.5))


def write_randoms(curves):
    """Give the strands that carry none their random numbers."""
    if len(curves.curves) and not _has_randoms(curves):
        attributes.write(curves, "strand_random", "FLOAT", "CURVE", read_randoms(curves))


def _has_randoms(curves):
    attribute = curves.attributes.get("strand_random")
    return attribute is not None and (attribute.data_type, attribute.domain) == ("FLOAT", "CURVE")


def is_combed(curves):
    """Whether points were moved, added or removed since `write_points`."""
    from ..core.fingerprint import fingerprint  # Warp takes longer to import than the add-on may take to start

    written = curves.vellus.written
    return written != "" and len(curves.points) > 0 and written != fingerprint(read_points(curves))


def read_roots(curves, surface, first_points):
    """Where (S, 3) first points are rooted: as stored, or the nearest place where that is missing or stale.

    Curves that were added or slid in sculpt mode are stale, and so are all when the surface has other triangles.
    """
    mesh_math.check_mesh(surface.mesh)
    stored = stored_roots(curves, surface)
    if stored is None or curves.vellus.topology != surface.topology:
        return _nearest_roots(surface, first_points)
    distance = np.linalg.norm(mesh_math.positions(surface.mesh, stored) - first_points, axis=1)
    stale = np.flatnonzero(~(distance <= _ROOT_TOLERANCE * surface.extent * surface.scale))
    if len(stale):
        found = _nearest_roots(surface, first_points[stale])
        stored.triangle[stale] = found.triangle
        stored.barycentric[stale] = found.barycentric
    return stored


def _nearest_roots(surface, places):
    from ..core.surface_query import SurfaceQuery  # Warp takes longer to import than the add-on may take to start

    mesh_math.check_mesh(surface.mesh)
    return SurfaceQuery(surface.mesh).nearest(places)


def stored_roots(curves, surface):
    """`SurfacePoints` from the curves' attributes; impossible ones become a corner of triangle 0. None if absent."""
    barycentric = attributes.read(curves, "root_barycentric", 3)
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


def root_places(curves, surface):
    """(S, 3) int32 root vertices and (S, 3) float32 barycentric coordinates in Blender's order, on a `Surface`.

    As stored, or where the surface at rest is nearest if that has other triangles now.
    """
    stored = read_root_places(curves)
    if stored is not None and curves.vellus.topology == surface.topology:
        return stored
    counts = point_counts(curves)
    firsts = np.concatenate([[0], np.cumsum(counts[:-1])])
    roots = _nearest_roots(surface, surface.from_local(read_points(curves)[firsts]))
    return surface.root_vertices(roots), surface.swap_winding(roots).barycentric


def followers(guide_curves):
    """The hair Curves that follow some guides."""
    return [c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR" and c.vellus.guide_curves == guide_curves]


def require_editable(datablock):
    """Raise `HairError` for linked data: Blender would accept the change and lose it on reload."""
    if datablock.library is not None:
        raise HairError(f'"{datablock.name}" is linked from another file: make a library override of it first.')
