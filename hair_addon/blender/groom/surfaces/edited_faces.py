# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots on a surface with changed faces: roots keep their place in faces that still exist.

Edits of other faces, such as *Join*, *Separate* or *Extrude*, renumber vertices and faces. Vertices are matched by
their positions when strands were rooted. Roots of deleted faces move to the nearest points.
"""

from dataclasses import dataclass

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import geometry
from ....core.geometry.mesh import SurfacePoints, TriMesh, check_mesh, require_finite
from ...data import surface_space
from ...data.strands import attributes, curves, kept_shapes, posed_strands, stored_roots
from ...data.surfaces import Surface, cage_of, faces_of
from ...host.caches import Cache
from .. import bindings, staleness

# (`Surface.topology`, fingerprint of the first points of strands) → stored (triangles, barycentric coordinates).
left_cache = Cache(capacity=32)


@dataclass(frozen=True)
class _Edit:
    """Mapping of the vertices that strands were rooted between."""

    surface: Surface  # current state
    matching: np.ndarray  # (V,) int32: present index of each former vertex, -1 if deleted
    before: np.ndarray  # (W, 3) float32: former positions of the present vertices; present ones of new vertices


def reroot(strands: Curves, surface: Surface, depsgraph: Depsgraph) -> tuple[int, int]:
    """Root guides or kept hair, and the hair between guides, on a surface with other faces.

    Strands follow vertices that were moved in the same edit. Returns the numbers of guides (or kept strands) and of
    strands between guides whose face was deleted. Raises `HairError` as `check_mesh`.
    """
    check_mesh(surface.mesh)
    edit = _edit(surface_space.rest_before(strands), surface)
    places, stored = _rooted(strands, edit)
    is_moved, lost_between = not np.array_equal(edit.before, surface.rest), 0
    if is_moved:
        _carry(strands, surface, edit.before, places, stored)
    for hair in _between(strands):
        between, on_surface = _rooted(hair, edit)
        if is_moved and _is_edited(hair):
            _carry(hair, surface, edit.before, between, on_surface)
        _write(hair, edit, on_surface, depsgraph)
        lost_between += int((~between[1].any(axis=1)).sum())
    _write(strands, edit, stored, depsgraph)
    surface_space.keep_surface(strands, surface)
    return int((~places[1].any(axis=1)).sum()), lost_between


def follow_moved(strands: Curves, surface: Surface, before: np.ndarray) -> None:
    """Move guides or kept hair, and combed strands between guides, with moved vertices.

    before: (V, 3) former positions of the vertices.
    """
    root_on_present_level(strands, surface, before)
    for target in (strands, *filter(_is_edited, _between(strands))):
        on_cage = None if surface.divided_of is None else stored_roots.cage_points(target, surface.cage)
        if on_cage is not None:  # independent of the present level of subdivision
            cage = surface.cage
            _carry(target, cage, before[: len(cage.rest)], cage.places(on_cage), on_cage)
            curves.write_roots(target, cage, on_cage)
            continue
        places, roots = stored_roots.places(target, len(surface.rest)), stored_roots.points(target, surface)
        if places is not None and roots is not None and faces_of(target.vellus.topology) == faces_of(surface.topology):
            _carry(target, surface, before, places, roots)
            curves.write_roots(target, surface, roots, firsts=curves.first_points(target))


def _between(strands):
    """Writable hair between guides."""
    followers = (hair for hair in curves.followers(strands) if not curves.is_hand_made(hair) and len(hair.curves))
    return [hair for hair in followers if not attributes.is_from_library(hair)]


def _is_edited(hair):
    """Whether an artist has combed strands between guides; these are not regenerated."""
    bound = bindings.of(hair)
    return (bound is None or bound.is_written) and curves.is_combed(hair)


def change_level(strands: Curves, surface: Surface) -> None:
    """Root guides or kept hair on a surface with another level of subdivision, at the nearest points.

    No strand moves, and strands between guides keep their roots, as renders have their own levels. Back at a former
    level, roots get their former values, bit for bit, if the strands still start at the same points.
    """
    state, digest = strands.vellus, geometry.fingerprint.fingerprint(curves.first_points(strands))
    triangle, barycentric = stored_roots.raw(strands)
    if triangle is not None and barycentric is not None:
        left_cache.keep((state.topology, digest), (triangle, barycentric))
    known = left_cache.get((surface.topology, digest))
    if known is None:
        roots = curves.nearest_roots(surface, _firsts(strands, surface))
    else:
        roots = surface.swap_winding(SurfacePoints(*known))
    curves.write_roots(strands, surface, roots, firsts=curves.first_points(strands))
    surface_space.keep_surface(strands, surface)
    for hair in _between(strands):
        curves.write_smoothness(hair, surface)


def root_on_present_level(strands: Curves, surface: Surface, before: np.ndarray) -> None:
    """Root hair between guides on the present faces if it is rooted at another level of subdivision, before it moves.

    before: (V, 3) positions of the surface's vertices that correspond to the strands' first points.
    """
    for hair in _between(strands):
        topology = hair.vellus.topology
        if topology != surface.topology and cage_of(topology) == cage_of(surface.topology):
            mesh = TriMesh(surface.from_local(before), surface.mesh.triangles)
            roots = geometry.closest_point.SurfaceQuery(mesh).nearest(_firsts(hair, surface))
            curves.write_roots(hair, surface, roots, firsts=curves.first_points(hair))


def _firsts(strands, surface):
    return surface.from_local(curves.first_points(strands))


def _carry(strands, surface, before, places, roots):
    """Move strands with their surface; strands without a place do not move.

    places: (S, 3) vertices and (S, 3) weights; roots: the same as `SurfacePoints`, which differ where a face is
    triangulated differently than before.
    """
    vertices, weights = places
    counts, is_lost = curves.point_counts(strands), ~weights.any(axis=1)
    motion = geometry.surface_deform.motion(before, surface.rest, surface.faces, vertices[~is_lost])
    its_vertices, its_weights = surface.places(roots)
    slide = _at(surface.rest, its_vertices, its_weights) - _at(surface.rest, vertices, weights)
    slide[is_lost | (its_vertices == vertices).all(axis=1)] = 0.0

    def carried(points):
        moved = posed_strands.carried(points, motion, places, counts) + np.repeat(slide, counts, axis=0)
        return np.where(np.repeat(is_lost, counts)[:, None], points, moved)

    kept_shapes.move(strands, carried)


def _at(positions, vertices, weights):
    return (weights[..., None] * positions[vertices]).sum(axis=1)


def _edit(before, surface):
    require_finite(surface.rest)
    if before is None:
        before = np.zeros((0, 3), np.float32)
    matching = geometry.faces.face_places.matching_vertices(before, surface.rest)
    there = surface.rest.copy()
    is_known = matching >= 0
    there[matching[is_known]] = before[is_known]
    return _Edit(surface, matching, there)


def _rooted(strands, edit):
    """Return ((S, 3) present vertices and (S, 3) weights, zeros if the face was deleted), `SurfacePoints` (S,)."""
    surface = edit.surface
    stored = stored_roots.places(strands, len(edit.matching))
    if stored is None:
        count = len(strands.curves)
        vertices, weights = np.zeros((count, 3), np.int32), np.zeros((count, 3), np.float32)
    else:
        vertices, weights = stored
    known = np.flatnonzero(weights.any(axis=1))
    now = edit.matching[vertices[known]]
    polygons = _polygons_with(surface, now)
    known, now, polygons = (rows[polygons >= 0] for rows in (known, now, polygons))
    found, are_none = surface.points_at(polygons, now, weights[known])
    is_lost = np.ones(len(vertices), bool)
    is_lost[known[~are_none]] = False
    vertices[known], vertices[is_lost], weights[is_lost] = now, 0, 0.0
    triangle, barycentric = np.empty(len(vertices), np.int32), np.empty((len(vertices), 3), np.float32)
    triangle[known], barycentric[known] = found.triangle, found.barycentric
    if is_lost.any():
        nearest = curves.nearest_roots(surface, _firsts(strands, surface)[is_lost])
        triangle[is_lost], barycentric[is_lost] = nearest.triangle, nearest.barycentric
    return (vertices, weights), SurfacePoints(triangle, barycentric)


def _polygons_with(surface, vertices):
    """Return `face_places.polygons_with` of roots, computed once for roots between the same vertices."""
    count = len(surface.rest)
    keys = (vertices[:, 0].astype(np.float64) * count + vertices[:, 1]) * count + vertices[:, 2]
    if count > 200_000:  # beyond which such a number is not exact
        return geometry.faces.face_places.polygons_with(surface.triangulated, count, vertices)
    _keys, first, which = np.unique(keys, return_index=True, return_inverse=True)
    return geometry.faces.face_places.polygons_with(surface.triangulated, count, vertices[first])[which]


def _write(strands, edit, roots, depsgraph):
    """Store roots, and count them as placed by the present mask unless it was painted."""
    curves.write_roots(strands, edit.surface, roots)
    staleness.keep_roots(strands, depsgraph, edit.matching)
