# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow painted by a brush: strokes on the posed surface turn the guides near them, while drawn or at once."""

import numpy as np
from bpy.types import Curves, Depsgraph, Object
from mathutils import Vector

from ....core import geometry, grooming
from ....core.errors import HairError
from ....core.geometry import mesh as mesh_math
from ....core.grooming.guide_tool_settings import FlowSettings
from ...data.strands import attributes
from . import guide_tools, outside_guides

_MIRROR = np.array([-1.0, 1.0, 1.0])  # along the local X axis
_PROBE = 1e-2  # length of the probe that carries directions to rest, relative to the radius
_MOST_POINTS = 10_000  # of a stroke
_PART = 0.12  # default radius as a fraction of the size of the surface
_CIRCLE = 64  # points of the brush's circle


class FlowStroke:
    """A stroke of the brush: the guides before the stroke, and the effect of the stroke so far.

    Each call of `extend` turns the guides as they were before the stroke, so one call with all points has the same
    result.
    """

    def __init__(self, datablock: Curves, settings: FlowSettings, depsgraph: Depsgraph) -> None:
        """Read the guides and their posed surface. Raises `HairError`."""
        self._guides = guides = guide_tools.read(datablock, settings, depsgraph)
        self._settings = settings
        self._mesh = guides.surface.posed_mesh
        mesh_math.require_finite(self._mesh.vertices)
        self._query = geometry.closest_point.SurfaceQuery(self._mesh)
        self._roots = guides.posed()[guides.starts[:-1]]
        normals = mesh_math.normals(self._mesh, guides.roots)
        sides = 2 if settings.mirrored else 1
        values = (self._roots, normals, settings.radius, settings.strength)
        self._sides = [grooming.painted_flow.PaintedFlow(*values) for _side in range(sides)]
        self._barrier = outside_guides.prepared(guides, 0.0, ()) if datablock.vellus.keeps_outside else None
        self._last = None
        self._by_count = guide_tools.to_shape(guides)
        self._shapes = guide_tools.ShapesOfStroke(guides)
        self._flow = np.zeros((len(guides.counts), 4))  # directions and shares that guides are turned by

    def extend(self, stroke: np.ndarray) -> int:
        """Add points (K, 3) in local coordinates of the posed surface to the stroke; returns the number of turned
        guides. Raises `HairError`.
        """
        stroke = np.asarray(stroke, np.float64).reshape(-1, 3)
        if not np.isfinite(stroke).all():
            raise HairError("The stroke has non-finite coordinates: paint again.")
        if self._last is not None:
            stroke = np.concatenate([self._last[None], stroke])
        if len(stroke) > 1:
            for side, factor in zip(self._sides, (1.0, _MIRROR), strict=False):
                self._paint(side, self._guides.surface.from_local(stroke * factor))
        self._last = stroke[-1] if len(stroke) else self._last
        return self._turn()

    def restore(self) -> None:
        """Write the guides as they were before the stroke."""
        guides = self._guides
        attributes.write(guides.datablock, "position", "FLOAT_VECTOR", "POINT", guides.local)
        guides.datablock.update_tag()

    def _paint(self, side, places):
        normals = mesh_math.normals(self._mesh, self._query.nearest(0.5 * (places[1:] + places[:-1])))
        for start, end, normal in zip(places[:-1], places[1:], normals, strict=True):
            side.extend(start, end, normal)

    def _turn(self):
        guides, barrier = self._guides, self._barrier
        first = self._sides[0]
        directions, shares = first.directions, first.shares
        if self._settings.mirrored:
            directions, shares = grooming.painted_flow.joined_flow(*self._sides)
        # Guides beyond the reach of the last pieces stay as they are shown.
        flow = np.column_stack([directions, shares * guides.weights])
        is_changed = (flow != self._flow).any(axis=1)
        shapes = []
        for chosen, places in self._by_count:
            its = is_changed[chosen]
            chosen, places = chosen[its], places[its]
            if not len(chosen):
                continue
            points, normals = guides.taken(guides.points, chosen, places), guides.normals[chosen]
            shares = flow[chosen, 3]
            at_rest = self._at_rest(directions, chosen)
            turned = grooming.painted_flow.turned_along(points, normals, at_rest, shares, self._settings)
            near = shares > 0.0
            if barrier is not None and near.all():
                turned = outside_guides.pushed(guides, barrier, turned, chosen)
            elif barrier is not None and near.any():
                turned[near] = outside_guides.pushed(guides, barrier, turned[near], chosen[near])
            shapes.append((chosen, places, turned))
        moved_count = self._shapes.write(shapes)
        self._flow = flow
        return moved_count

    def _at_rest(self, directions, chosen):
        """Return directions (M, 3) at the posed roots of chosen guides, carried to the surface at rest."""
        starts = self._roots[chosen].astype(np.float64)
        reach = _PROBE * self._settings.radius
        probes = np.stack([starts, starts + reach * directions[chosen]], axis=1).astype(np.float32)
        carried = self._guides.carried_back(probes, chosen)
        return grooming.guide_shapes.unit(np.diff(carried.astype(np.float64), axis=1)[:, 0])


def paint(datablock: Curves, stroke: np.ndarray, settings: FlowSettings, depsgraph: Depsgraph) -> int:
    """Turn guides along a stroke (K, 3) in local coordinates of their posed surface; returns the number of turned
    guides.

    Raises `HairError` before anything changes.
    """
    if len(stroke) < 2:
        raise HairError("The stroke has no length: drag over the surface.")
    if len(stroke) > _MOST_POINTS:
        raise HairError(
            "A stroke can have at most {most} points, not {count}: paint shorter strokes.",
            most=_MOST_POINTS,
            count=len(stroke),
        )
    return FlowStroke(datablock, settings, depsgraph).extend(stroke)


def place_on(surface: Object, origin: Vector, direction: Vector, depsgraph: Depsgraph) -> np.ndarray | None:
    """Return where a ray in world coordinates first hits a posed surface, (3,) in its local coordinates, or None."""
    found = _hit(surface, origin, direction, depsgraph)
    return None if found is None else found[0]


def brush_circle(
    surface: Object, origin: Vector, direction: Vector, radius: float, depsgraph: Depsgraph
) -> np.ndarray | None:
    """Return points (N, 3) of the brush's circle, in world coordinates; None if the ray does not hit the posed surface.

    The center is the first hit of the ray, and the circle is tangent to the surface. radius: in world coordinates.
    """
    found = _hit(surface, origin, direction, depsgraph)
    if found is None:
        return None
    to_world = np.array(surface.matrix_world)
    middle = to_world[:3, :3] @ found[0] + to_world[:3, 3]
    normal = np.linalg.pinv(to_world[:3, :3]).T @ found[1]
    length = np.linalg.norm(normal)
    if not length > 0.0:
        return None
    across = np.linalg.svd(normal[None] / length)[2][1:]  # two unit vectors of the tangent plane
    turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE, endpoint=False)[:, None]
    return middle + radius * (np.cos(turn) * across[0] + np.sin(turn) * across[1])


def default_radius(datablock: Curves) -> float | None:
    """Return a radius of the brush [m] that fits the surface of guides; None without a surface."""
    size = guide_tools.surface_size(datablock)
    return _PART * size if size else None


def _hit(surface, origin, direction, depsgraph):
    """Return (place, normal), in local coordinates, of a surface's first hit by a ray in world coordinates, or None."""
    to_local = surface.matrix_world.inverted_safe()
    start = to_local @ origin
    is_hit, place, normal, _face = surface.evaluated_get(depsgraph).ray_cast(start, to_local.to_3x3() @ direction)
    return (np.array(place), np.array(normal)) if is_hit else None
