# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides kept outside of their posed surface: after each event of a stroke, when guides are added, and by Push
Outside.

Points are pushed out from root to tip; roots and segment lengths do not change. All surfaces are scaled to the size of
a head, so that tolerances do not depend on the units of a scene.
"""

from dataclasses import dataclass, replace

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import dynamics, grooming
from ....core.errors import HairError
from ....core.geometry import mesh as mesh_math
from ....core.grooming.guide_tool_settings import OutsideSettings
from ...data.strands import attributes, curves, frozen_points, posed_strands
from ...data.surfaces import Surface
from ...host.caches import Cache
from . import guide_tools
from .guide_tools import CombedGuides

_HEAD = 0.25  # [m] extent that surfaces are scaled to
_SKIN = 5e-5  # [m] distance of guides from a surface of this extent
_GRID_POINTS = 3_200_000  # the grid of distances is as fine as for this number of points, as it serves many events

# session_uid of guide Curves → `_Barrier` of their surface in its present pose.
barrier_cache = Cache(capacity=8)


@dataclass(frozen=True)
class _Barrier:
    """The posed surface of guides, prepared for pushing; key: of the surface and its transform."""

    key: tuple
    surface: Surface
    barrier: "dynamics.outside.Barrier"
    factor: float  # from meters to a surface of the extent of a head


def push(datablock: Curves, settings: OutsideSettings, depsgraph: Depsgraph) -> int:
    """Push guides out of their posed surface; returns the number changed. Raises `HairError`."""
    guides = guide_tools.read(datablock, settings, depsgraph)
    barrier = prepared(guides, settings.clearance, ())
    after = guides.points.copy()
    for chosen, places in guide_tools.to_shape(guides):
        pushed, is_moved = _pushed(guides, barrier, chosen, places)
        weights = guides.weights[chosen]
        partly = grooming.guide_shapes.blended(guides.points[places], pushed, weights)
        pushed = np.where((weights < 1.0)[:, None, None], partly, pushed)
        after[places[is_moved]] = pushed[is_moved]
    return guide_tools.write_shapes(guides, after)


def push_new(datablock: Curves, former: np.ndarray, depsgraph: Depsgraph) -> None:
    """Push new guides outside: between guides on opposite sides of a head, they would pass through it.

    former: (N, 3) local points of the guides before the addition.
    """
    points = curves.read_points(datablock)
    pushed = pushed_out(datablock, points[: len(former)], points, depsgraph)
    if pushed is not points:
        attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", pushed)
        datablock.update_tag()


def pushed_out(datablock: Curves, former: np.ndarray, points: np.ndarray, depsgraph: Depsgraph) -> np.ndarray:
    """Return local points (N, 3) of guides, of which those that differ from `former` points are pushed outside.

    `points` itself if no guide is pushed. Guides without a surface, or with invalid points, are unchanged.
    """
    starts = curves.curve_offsets(datablock).astype(np.int64)
    changed = _changed(starts, former, points)
    if not changed.any():
        return points
    try:
        barrier = _known(datablock, former, depsgraph)
        if not posed_strands.pose_of(barrier.surface).is_deformed:
            return _pushed_at_rest(datablock, barrier, points, starts, changed)
        guides = replace(guide_tools.on_surface(datablock, barrier.surface), local=points)
    except HairError:
        return points  # panels report what is wrong with the guides or their surface
    guides = replace(guides, points=barrier.surface.from_local(points), weights=changed)
    local = points.copy()
    is_pushed = False
    for chosen, places in guide_tools.to_shape(guides):
        pushed, is_moved = _pushed(guides, barrier, chosen, places)
        rows = places[is_moved]
        moved = (pushed[is_moved] != guides.points[rows]).any(axis=2)
        local[rows[moved]] = barrier.surface.to_local(pushed[is_moved][moved][:, None])[:, 0]
        is_pushed |= bool(moved.any())
    return local if is_pushed else points


def _pushed_at_rest(datablock, barrier, points, starts, changed):
    """Return the result of `pushed_out` on a surface at rest. Only changed guides are read, as strokes must be fast."""
    counts, local, are_frozen = np.diff(starts), points, frozen_points.read(datablock)
    is_chosen = (counts > 1) & (changed > 0.0)
    for count in np.unique(counts[is_chosen]):
        chosen = np.flatnonzero((counts == count) & is_chosen)
        firsts, along = starts[chosen], np.arange(count)
        are_all = len(chosen) * count == len(points)  # a copy of all points would take a fifth of the time
        shape = points.reshape(-1, count, 3) if are_all else points[firsts[:, None] + along]
        held = None if are_frozen is None else _held(are_frozen[firsts[:, None] + along])
        axes = barrier.factor * barrier.surface.to_world_axes
        rows, after, is_same = barrier.barrier.moved_local(shape, axes, held, chosen)
        if not is_same.all():
            local = points.copy() if local is points else local
            after = (after[~is_same] / barrier.factor).astype(np.float32)
            places = firsts[rows][:, None] + along
            local[places[~is_same]] = barrier.surface.to_local(after[:, None])[:, 0]
    return local


def _changed(starts, former, points):
    """Return (G,) float64: 1 for guides that have other points than before, or are new."""
    changed = np.zeros(len(starts) - 1)
    if len(former) > len(points):
        return changed  # guides were removed
    is_other = np.ones((len(points), 3), bool)
    np.not_equal(points[: len(former)], former, out=is_other[: len(former)])
    has_points = np.diff(starts) > 0
    changed[has_points] = np.logical_or.reduceat(is_other.ravel(), 3 * starts[:-1][has_points])
    return changed


def _known(datablock, former, depsgraph):
    """Return the `_Barrier` of guides, from the cache if their surface has the same pose. Raises `HairError`."""
    surface_object = datablock.surface
    if surface_object is None:
        raise HairError("The surface is missing: pick a mesh.")
    key = (surface_object.session_uid, *(value for row in surface_object.matrix_world for value in row))
    known = barrier_cache.get(datablock.session_uid)
    if known is None or known.key != key:
        guides = guide_tools.open_guides(datablock, depsgraph)
        if len(former) == len(guides.local):  # before the stroke
            guides = replace(guides, local=former, points=guides.surface.from_local(former))
        known = barrier_cache.keep(datablock.session_uid, prepared(guides, 0.0, key))
    return known


def prepared(guides: CombedGuides, clearance: float, key: tuple) -> _Barrier:
    """Return the `_Barrier` of guides with a clearance [m]. Raises `HairError` if it cannot be collided with."""
    surface = guides.surface
    mesh_math.require_finite(surface.posed)
    factor = _HEAD / max(surface.extent * surface.scale, 1e-20)
    mesh = surface.posed_mesh
    triangles = mesh.triangles
    for chosen, places in guide_tools.to_shape(replace(guides, weights=np.ones(len(guides.counts)))):
        posed = guides.posed_of(chosen, places[:, :2])
        triangles = dynamics.collision.closed_parts.facing_strands(mesh, posed[:, 0], posed[:, 1])
        break  # guides of one point count are enough to tell the sides of an open surface
    vertices = factor * mesh.vertices.astype(np.float64)
    distance = max(_SKIN, factor * clearance)
    obstacle = dynamics.simulation.Obstacle("surface", vertices, triangles, 0.0, distance)
    origin = vertices.mean(axis=0)
    return _Barrier(key, surface, dynamics.outside.Barrier([obstacle], origin, _GRID_POINTS, "cpu"), factor)


def pushed_posed(barrier: _Barrier, posed: np.ndarray) -> np.ndarray:
    """Return posed guides (M, P, 3) float32 [m] outside of the posed surface."""
    after, is_moved = barrier.barrier.moved(barrier.factor * posed.astype(np.float64))
    found = posed.copy()
    found[is_moved] = (after[is_moved] / barrier.factor).astype(np.float32)
    return found


def pushed(guides: CombedGuides, barrier: _Barrier, points: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return new points (M, P, 3) float32 [m] of chosen guides (M,) pushed outside of the posed surface.

    `points` itself if no guide moves.
    """
    places = guides.of_count(points.shape[1], chosen)
    return _pushed_shape(guides, barrier, chosen, places, points, guides.posed_shape(chosen, points))[0]


def _pushed(guides, barrier, chosen, places):
    """Return (points (M, P, 3) float32 [m] at rest outside of the posed surface, (M,) bool: which guides moved)."""
    posed = guides.posed_of(chosen, places)
    return _pushed_shape(guides, barrier, chosen, places, guides.points[places], posed)


def _pushed_shape(guides, barrier, chosen, places, shape, posed):
    """Return the result of `_pushed` for guides with a shape (M, P, 3) at rest and posed points (M, P, 3).

    The shape itself if no guide moves.
    """
    are_frozen = frozen_points.read(guides.datablock)
    held = None if are_frozen is None else _held(are_frozen[places])
    rows, after, is_same = barrier.barrier.moved_local(posed, barrier.factor * np.eye(3), held, chosen)
    pushed, is_moved = shape, np.zeros(len(shape), bool)
    if len(rows):
        pushed = shape.copy()
        # Points that stay keep their bits, the root among them.
        at_rest = guides.carried_back((after / barrier.factor).astype(np.float32), chosen[rows])
        pushed[rows] = np.where(is_same[..., None], pushed[rows], at_rest)
        is_moved[rows] = True
    return pushed, is_moved


def _held(frozen):
    """Return (M,) number of points from each root that do not move; frozen: (M, P) bool, overwritten."""
    frozen[:, 0] = True
    return np.where(frozen.all(axis=1), frozen.shape[1], np.argmin(frozen, axis=1))
