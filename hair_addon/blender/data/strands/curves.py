# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands: arrays ↔ Blender's Curves, with the attributes that Sculpt Mode, hair nodes and renderers expect.

Curves are poly lines: 41 points are smooth enough, every hair node group supports them, and Blender's
evaluation of Catmull-Rom curves would cost more than generating the strands.
"""

import bpy
import numpy as np

from ....core import geometry
from ....core.errors import HairError
from ....core.geometry import mesh as mesh_math
from ....core.geometry import strands
from ....core.grooming import groom
from ...host.notices import name_of
from .. import scene
from ..surfaces import cage_of
from . import attributes, follow_nodes, simulated_guides, stored_roots

_GUIDE_MAP = ("guide_index", "guide_weight")

_WETNESS = "wetness"  # per strand, if a mask or a variation of the style Wet makes strands differ

# A stored root is outdated if its distance from the curve's first point exceeds this fraction of the surface's size.
_ROOT_TOLERANCE = 1e-4


def _write_positions(curves, points):
    """Write (..., 3) float32 points of all curves, and their fingerprint for `is_combed`."""
    curves.vellus.written = attributes.write_positions(curves, points)


def _write_radii(curves, radii):
    """Write radii (P,) of every strand or (S, P) of each, unless they are unchanged."""
    radii, present = np.asarray(radii, np.float32), attributes.read(curves, "radius", "FLOAT", "POINT")
    if present is not None and attributes.are_radii(present, radii):
        return
    values = np.tile(radii, len(curves.curves)) if radii.ndim == 1 else radii.ravel()
    attributes.write(curves, "radius", "FLOAT", "POINT", values)


def make_strands(curves, surface, roots, radii, identities, *, leaders=None, normals=None):
    """Resize the curves for strands, and write everything except their points.

    roots: `SurfacePoints` (S,); radii: (P,) of all strands or (S, P), in local coordinates; identities: from
    `Surface.identities`;
    leaders: (S,) int32, the strand that represents the guide of each strand; None for guides;
    normals: (S, 3) float32 of the surface at the roots, if known.
    Returns the `Surface` that the roots are stored on, like `write_roots`.
    """
    if len(roots) == 0:
        raise ValueError("no strands: an empty list of curves would crash Blender")
    _resize(curves, len(roots), np.shape(radii)[-1])
    _write_radii(curves, radii)
    if leaders is not None:
        # Blender's hair nodes clump, curl and braid strands around this curve.
        attributes.write(curves, "guide_curve_index", "INT", "CURVE", leaders)
    for name, data_type, values in zip(("id", "strand_random"), ("INT", "FLOAT"), identities, strict=True):
        attributes.write(curves, name, data_type, "CURVE", values)
    return write_roots(curves, surface, roots, normals)


def write_guide_map(curves, guide_map):
    """Store (S, k) int32 guides of strands and (S, k) float32 weights, one pair of attributes for each k.

    guide_index_0 and guide_weight_0 belong to the nearest guide. None removes the attributes.
    """
    slot_count = 0 if guide_map is None else guide_map[0].shape[1]
    for attribute in list(curves.attributes):
        kind, _, slot = name_of(attribute).rpartition("_")
        if kind in _GUIDE_MAP and slot.isdecimal() and int(slot) >= slot_count:
            curves.attributes.remove(attribute)
    for slot in range(slot_count):
        for name, data_type, values in zip(_GUIDE_MAP, ("INT", "FLOAT"), guide_map, strict=True):
            attributes.write(curves, f"{name}_{slot}", data_type, "CURVE", values[:, slot])


def write_clumps(curves, clumps):
    """Store (S,) int32 clumps of strands and (S,) float32 random numbers of clumps, for shaders; None removes them."""
    for name, data_type, place in (("clump_index", "INT", 0), ("clump_random", "FLOAT", 1)):
        _write_or_remove(curves, name, data_type, None if clumps is None else clumps[place])


def has_clumps(curves):
    """Whether `write_clumps` has stored clumps."""
    return attributes.has(curves, "clump_index", "INT", "CURVE")


def write_wetness(curves, wetness):
    """Store (S,) float32 wetness of strands, for shaders; None removes it. Returns whether it was added or removed."""
    had_wetness = has_wetness(curves)
    _write_or_remove(curves, _WETNESS, "FLOAT", wetness)
    return had_wetness != (wetness is not None)


def _write_or_remove(curves, name, data_type, values):
    if values is not None:
        attributes.write(curves, name, data_type, "CURVE", values)
    elif attributes.has(curves, name, data_type, "CURVE"):
        curves.attributes.remove(curves.attributes[name])


def write_roots(curves, surface, roots, normals=None, firsts=None):
    """Store the roots of strands for Vellus, for the nodes that deform strands, and for Blender's tools.

    Roots on a cage are also stored at the nearest points of the current subdivided surface. Returns the `Surface` that
    they are stored on. firsts: (S, 3) first points of strands that were rooted before, and keep their roots on the
    cage if they have any; None for new strands, which begin at their roots.
    """
    normals = surface.to_local_normals(mesh_math.normals(surface.mesh, roots) if normals is None else normals)
    cage, shown = surface.cage, scene.shown_surface(curves.surface, surface)
    on_cage = None if firsts is None else stored_roots.cage_points(curves, cage)
    if on_cage is None and firsts is not None and stored_roots.are_on_cage(curves, cage):
        on_cage = read_roots(curves, cage, cage.from_local(firsts))  # some strands were added
    if shown.topology != surface.topology:
        on_cage, firsts = roots, mesh_math.interpolate(surface.rest, surface.mesh, roots)
        surface, roots = shown, geometry.closest_point.SurfaceQuery(shown.local_mesh).nearest(firsts)
    is_on_cage = surface.topology == cage.topology
    has_slides = on_cage is not None or stored_roots.slides(curves) is not None
    if firsts is None or is_on_cage or not has_slides or stored_roots.may_start_off_surface(curves):
        stored_roots.write_slides(curves, None)
    else:
        stored_roots.write_slides(curves, mesh_math.interpolate(surface.rest, surface.mesh, roots) - firsts)
    stored_roots.write_cage(curves, cage, None if is_on_cage else on_cage)
    stored = surface.swap_winding(roots)
    attributes.write(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", surface.uvs(roots))
    attributes.write(curves, "surface_normal", "FLOAT_VECTOR", "CURVE", normals)
    attributes.write(curves, "root_triangle", "INT", "CURVE", stored.triangle)
    attributes.write(curves, "root_barycentric", "FLOAT_VECTOR", "CURVE", stored.barycentric)
    for name, vertices in zip(stored_roots.VERTICES, surface.root_vertices(roots).T, strict=True):
        attributes.write(curves, name, "INT", "CURVE", vertices)
    curves.surface_uv_map = surface.uv_map
    if curves.vellus.topology != surface.topology:
        curves.vellus.topology, curves.vellus.is_on_open = surface.topology, surface.is_open
    for user in bpy.data.objects:
        if user.data == curves and user.library is None:
            is_combed = curves.vellus.kind == "GUIDES" and surface.corner_uvs is not None
            follow_nodes.set_surface(user, curves.surface, len(surface.rest), is_combed, surface.cage_corners)
    curves.update_tag()
    return surface


def write_smoothness(curves, surface):
    """Update only the nodes' input for the surface's current subdivision."""
    for user in bpy.data.objects:
        if user.data == curves and user.library is None:
            follow_nodes.set_smoothness(user, surface.cage_corners)


def write_uvs(curves, surface):
    """Write only the UV coordinates of the roots."""
    if not len(curves.curves):
        return
    roots = read_roots(curves, surface, surface.from_local(first_points(curves)))
    attributes.write(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", surface.uvs(roots))
    curves.surface_uv_map = surface.uv_map
    curves.update_tag()


def write_points(curves, growing):
    """Write the points of strands that `make_strands` created; growing: a future of local (S, P, 3) float32."""
    # Blender copies the array that it shares with its last evaluation, which takes half of the writing time. The copy
    # is made while strands are computed.
    attributes.unshare_positions(curves)
    _write_positions(curves, growing.result())
    curves.update_tag()


def write_moved(curves, points):
    """Write points of strands that moved with their surface: combed strands remain combed."""
    if not len(curves.points):
        return
    before, was_combed = curves.vellus.written, is_combed(curves)
    _write_positions(curves, points)
    if was_combed:
        curves.vellus.written = before


def _resize(curves, strand_count, point_count):
    """Resize curves, unless they have these sizes."""
    if len(curves.curves) == strand_count and len(curves.points) == strand_count * point_count:
        sizes = point_counts(curves)
        if (sizes == point_count).all():
            return
    if len(curves.curves):
        curves.remove_curves()
    # `add_curves` accepts plain integers only.
    curves.add_curves([int(point_count)] * int(strand_count))
    curves.set_types(type="POLY")


def curve_offsets(curves):
    """Return (S+1,) int32: the index of each curve's first point, and the number of points."""
    offsets = np.zeros(len(curves.curves) + 1, np.int32)
    if len(curves.curves):
        curves.curve_offset_data.foreach_get("value", offsets)
    return offsets


def point_counts(curves):
    """Return (S,) int32: the number of points of each curve."""
    return np.diff(curve_offsets(curves))


def first_points(curves):
    """Return (S, 3) float32: the first point of each curve, in local coordinates."""
    return read_points(curves)[curve_offsets(curves)[:-1]]


def read_points(curves):
    """Return (all points, 3) float32 in local coordinates, curve after curve."""
    positions = np.empty((len(curves.points), 3), np.float32)
    if len(positions):
        curves.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions


def read_radii(curves, known=None, spare=None):
    """Return (all points,) float32 in local units, at least zero; Blender's default if curves have no radii.

    known: former radii, which are returned if nothing has changed; spare: an array of their size to read into, as new
    memory takes five times as long.
    """
    if known is not None and known.size == len(curves.points) and attributes.has(curves, "radius", "FLOAT", "POINT"):
        attributes.read_into(curves, "radius", "FLOAT", "POINT", spare)
        if np.array_equal(spare.ravel(), known.ravel()):
            return known.ravel()
    radii = attributes.read(curves, "radius", "FLOAT", "POINT")
    if radii is None:
        return np.full(len(curves.points), attributes.RADIUS, np.float32)
    return attributes.valid_radii(radii)


OWN_RADIUS = "own_radius"  # attribute of `kept_widths`


def widen(curves, change):
    """Scale radii, or Blender's default radius if curves have none, as an `Affine` scales widths."""
    own = attributes.read(curves, OWN_RADIUS, "FLOAT", "POINT")
    if own is not None and len(own):
        attributes.write(curves, OWN_RADIUS, "FLOAT", "POINT", change.widths(own))
    radii = attributes.read(curves, "radius", "FLOAT", "POINT")
    if radii is None and change.preserves_widths:
        return
    radii = np.full(len(curves.points), attributes.RADIUS, np.float32) if radii is None else radii
    if len(radii):
        attributes.write(curves, "radius", "FLOAT", "POINT", change.widths(radii))


def read_randoms(curves):
    """Return (S,) float32 random numbers of strands in [0, 1]; by index for curves without them."""
    randoms = attributes.read(curves, "strand_random", "FLOAT", "CURVE")
    if randoms is None:
        return strands.random_numbers(len(curves.curves))
    return np.where((randoms >= 0.0) & (randoms <= 1.0), randoms, np.float32(0.5))


def has_wetness(curves):
    """Whether wetness is stored per strand."""
    return attributes.has(curves, _WETNESS, "FLOAT", "CURVE")


def read_wetness(curves):
    """Return (S,) float32 wetness of strands in [0, 1]; None for curves without it."""
    wetness = attributes.read(curves, _WETNESS, "FLOAT", "CURVE")
    return None if wetness is None else np.clip(np.where(np.isfinite(wetness), wetness, np.float32(0.0)), 0.0, 1.0)


def write_randoms(curves):
    """Write random numbers for strands that have none."""
    if len(curves.curves) and attributes.read(curves, "strand_random", "FLOAT", "CURVE") is None:
        attributes.write(curves, "strand_random", "FLOAT", "CURVE", read_randoms(curves))


# The value of `written` for guides not created by Vellus: no fingerprint equals it, so they always count as combed.
BY_HAND = "made by hand"


def is_hand_made(curves):
    """Whether these are guides or hair not created by Vellus."""
    return curves.vellus.written == BY_HAND


def is_combed(curves):
    """Whether points were moved, added or removed since `write_points`, or were not written by it."""
    written = curves.vellus.written
    return written != "" and written != geometry.fingerprint.fingerprint(read_points(curves))


def read_roots(curves, surface, first_points):
    """Find the roots of (S, 3) first points: stored roots, or the nearest point if a root is missing or outdated.

    Roots of curves that were added or slid in Sculpt Mode are outdated, and all roots if the triangles changed.
    """
    mesh_math.check_mesh(surface.mesh)
    is_here = curves.vellus.topology == surface.topology
    stored = (
        stored_roots.points(curves, surface)
        if is_here
        else stored_roots.cage_points(curves, surface, is_complete=False)
    )
    if stored is None:
        return nearest_roots(surface, first_points)
    places, slides = mesh_math.positions(surface.mesh, stored), stored_roots.slides(curves) if is_here else None
    places = places if slides is None else places - surface.from_local(slides)
    distance = np.linalg.norm(places - first_points, axis=1)
    apart = attributes.read(curves, "root_distance", "FLOAT", "CURVE")
    if apart is not None:
        distance = abs(distance - apart * surface.scale)
    stale = np.flatnonzero(~(distance <= _ROOT_TOLERANCE * surface.extent * surface.scale))
    if len(stale):
        found = nearest_roots(surface, first_points[stale])
        stored.triangle[stale] = found.triangle
        stored.barycentric[stale] = found.barycentric
    return stored


def nearest_roots(surface, places, mesh=None):
    """`SurfacePoints` on a `Surface` that are nearest to (S, 3) places [m].

    mesh: the `TriMesh` to search, with the triangles of the surface; None: the surface at rest.
    """
    mesh = surface.mesh if mesh is None else mesh
    mesh_math.check_mesh(mesh)
    return geometry.closest_point.SurfaceQuery(mesh).nearest(places)


def read_guides(curves, surface, device, known=None, local=None):
    """Return combed guides as `Strands` on a device, with the same point count for all.

    known: `Strands` read before from the same guides on the same surface, whose roots are reused if no first point has
    moved. local: the result of `read_points`, if known.
    """
    counts = point_counts(curves)
    if not len(counts):
        raise HairError('"{name}" has no guides: generate guides first.', name=name_of(curves))
    local = read_points(curves) if local is None else local
    flat = local.ravel()
    # A finite sum of squares proves that all are finite, in a tenth of the time.
    with np.errstate(over="ignore", invalid="ignore"):
        squared = flat @ flat
    if not (np.isfinite(squared) or np.isfinite(flat).all()):
        sentence = '"{name}" has non-finite coordinates: undo, or delete those guides.'
        raise HairError(sentence, name=name_of(curves))
    points = surface.from_local(local)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    firsts = points[offsets[:-1]]
    has_known_roots = known is not None and np.array_equal(firsts, known.numpy()[:, 0])
    # Known roots may refer to faces of another subdivision.
    has_known_roots = has_known_roots and cage_of(curves.vellus.topology) == cage_of(surface.topology)
    roots = None if has_known_roots else read_roots(curves, surface, firsts)
    points = even_points(points, offsets, lambda: attributes.are_smooth(curves))
    return known.moved(points) if has_known_roots else strands.from_numpy(points, roots, device)


def read_shown_guides(curves, surface, device, known=None, local=None):
    """Return the guides that hair follows in this frame: simulated if shown, else as by `read_guides`."""
    guides = read_guides(curves, surface, device, known, local)
    shown = simulated_guides.point_cache.get(curves.session_uid)
    return guides if shown is None or len(shown) != len(guides) else guides.moved(surface.from_local(shown))


def even_points(points, offsets, are_smooth):
    """Return (G, POINT_COUNT, 3) float32 of guides of any point counts; points (N, 3), offsets (G+1,).

    are_smooth: a function that returns whether each guide is smooth, (G,) bool. Guides are resampled unless all have
    POINT_COUNT points.
    """
    if (np.diff(offsets) == groom.POINT_COUNT).all():
        return points.reshape(-1, groom.POINT_COUNT, 3)
    return geometry.curves.resampling.resample(points, offsets, groom.POINT_COUNT, are_smooth())


def even_local_points(curves):
    """Return (G, POINT_COUNT, 3) float32 of guides of any point counts, in local coordinates."""
    return even_points(read_points(curves), curve_offsets(curves), lambda: attributes.are_smooth(curves))


def followers(guide_curves):
    """Return the hair Curves that follow some guides."""
    return [c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR" and c.vellus.guide_curves == guide_curves]


def grown_on(hair):
    """Return the object that Curves grow on: the surface of the guides of generated hair, else their own surface."""
    guides = None if hair.vellus.kind != "HAIR" or is_hand_made(hair) else hair.vellus.guide_curves
    return hair.surface if guides is None or guides.surface is None else guides.surface


def follows_library(hair):
    """Whether hair Curves or their guides are linked, or library overrides."""
    return any(attributes.is_from_library(c) for c in (hair, hair.vellus.guide_curves) if c is not None)


def require_overridable(datablock):
    """Raise `HairError` for linked data, before changes that a library override stores, of dynamics or objects."""
    if datablock.library is not None:
        sentence = '"{name}" is linked from another file: make a library override of it first.'
        raise HairError(sentence, name=name_of(datablock))


def require_not_linked(datablock):
    """Raise `HairError` for linked data, before changes that overridden data keeps until the file is closed."""
    if datablock.library is not None:
        sentence = '"{name}" is linked from another file: make it local first, with Object ▸ Relations ▸ Make Local.'
        raise HairError(sentence, name=name_of(datablock))


def require_editable(datablock):
    """Raise `HairError` for linked and overridden data: Blender would accept the change and lose it on reload."""
    require_not_linked(datablock)
    if datablock.override_library is not None:
        sentence = '"{name}" is a library override: make it local first, with Object ▸ Relations ▸ Make Local.'
        raise HairError(sentence, name=name_of(datablock))
