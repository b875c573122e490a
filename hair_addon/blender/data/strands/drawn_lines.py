# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that are drawn on a surface, part lines and flow lines: curve objects → segments."""

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from ....core import interpolation
from ....core.errors import HairError
from ...host.notices import text_of
from . import curves
from .curves import curve_offsets

_POINT_LIMIT = 10_000  # as each strand reads all segments


@dataclass(frozen=True)
class Flow:
    """Flow lines, and the part lines that divide them: (L, 2, 3) float64 segments [m] in a `Surface`'s coordinates.

    None without lines; part lines are None without flow lines. key: as of `flow_key`.
    """

    lines: np.ndarray | None
    parting: np.ndarray | None
    key: str

    def at_rest(self, shown, surface, device):
        """Move lines from the shown `Surface` to the surface at rest, as `at_rest` does."""
        lines, parting = (at_rest(each, shown, surface, device) for each in (self.lines, self.parting))
        return Flow(lines, parting, self.key)


def read_flow(surface_object, surface, name, part_names, depsgraph):
    """Return the `Flow` of a curve object, divided by the part lines of other objects. Raises `HairError`."""
    lines = read(surface_object, surface, name, depsgraph)
    parts = [] if lines is None else [read(surface_object, surface, each, depsgraph) for each in part_names]
    parts = [part for part in parts if part is not None]
    key = flow_key(surface_object, name, part_names, depsgraph)
    return Flow(lines, np.concatenate(parts) if parts else None, key)


def flow_key(surface_object, name, part_names, depsgraph):
    """Return the `key` of flow lines, with that of the part lines that divide them. Raises `HairError`."""
    own = key(surface_object, name, depsgraph)
    return "-".join([own, *(key(surface_object, each, depsgraph) for each in part_names)]) if own else ""


def part_names_around(guide_curves):
    """Return the names of the part lines of all hair that follows some guides (or None), without missing objects."""
    if guide_curves is None:
        return []
    generated = (hair for hair in curves.followers(guide_curves) if not curves.is_hand_made(hair))
    return existing({text_of(hair.vellus.hair, "part_lines") for hair in generated})


def existing(names):
    """Return the sorted names of objects that exist."""
    return sorted(name for name in names if name and name in bpy.data.objects)


def read(surface_object, surface, name, depsgraph):
    """Return (L, 2, 3) float64 segments [m] of a curve object, or of a mesh's loose edges, in a `Surface`'s
    coordinates.

    Lines run from the start to the end of their curves. None for an empty name. Raises `HairError`.
    """
    local = _read_local(surface_object, name, depsgraph)
    return None if local is None else local @ surface.to_world_axes.T


def key(surface_object, name, depsgraph):
    """Return a digest of the lines that `read` returns, which stays while they move with the surface; empty for
    none.

    Raises `HairError`.
    """
    local = _read_local(surface_object, name, depsgraph)
    return "" if local is None else hashlib.blake2b(local.tobytes(), digest_size=16).hexdigest()


def _read_local(surface_object, name, depsgraph):
    """Return the segments of `read` in the coordinates of the surface's object."""
    if not name:
        return None
    drawn = bpy.data.objects.get(name)
    if drawn is None:
        raise HairError('There is no object "{name}": pick a curve for the lines, or clear the field.', name=name)
    if drawn.type not in {"CURVE", "CURVES", "MESH"} or (drawn.type == "CURVES" and drawn.data.vellus.kind != "NONE"):
        raise HairError('"{name}" cannot be used as lines: pick a curve, or clear the field.', name=name)
    points, edges = _read_curves(drawn.data) if drawn.type == "CURVES" else _read_edges(drawn, depsgraph)
    if not len(edges) and drawn.type == "CURVE" and drawn.mode == "EDIT":
        return None  # the first line is about to be drawn
    if not len(edges):
        raise HairError('"{name}" has no lines: draw a line of at least two points, without bevel.', name=name)
    if len(edges) > _POINT_LIMIT:
        sentence = '"{name}" has {count} points, too many for lines on a surface: lower its resolution.'
        raise HairError(sentence, name=name, count=len(edges))
    to_local = np.array(_to_local(surface_object, drawn), np.float64)

    return (points @ to_local[:3, :3].T + to_local[:3, 3])[interpolation.part_lines.in_order(edges)]


def _to_local(surface_object, drawn):
    """Return the transform from an object's coordinates to the surface's; of a child without the rounding of its
    parent's.
    """
    if drawn.parent == surface_object and drawn.parent_type == "OBJECT" and not drawn.constraints:
        return drawn.matrix_parent_inverse @ drawn.matrix_basis
    return surface_object.matrix_world.inverted_safe() @ drawn.matrix_world


def at_rest(lines, shown, surface, device):
    """Move lines from the shown `Surface` to the surface at rest, if `surface` is its cage.

    The two are the same without subdivision.
    """
    if lines is None or not surface.is_cage or shown.drawn_on is None:
        return lines
    return interpolation.part_lines.at_rest(shown.mesh, lines, shown.drawn_on, device)


def have_moved(name, surface_object, changed, transformed):
    """Whether lines may have moved on their surface: they are among `changed` datablocks, or it among `transformed`."""
    drawn = bpy.data.objects.get(name) if name else None
    return drawn is not None and (drawn in changed or drawn.data in changed or surface_object in transformed)


def _read_edges(drawn, depsgraph):
    """Return (N, 3) float64 points and (L, 2) loose edges of an evaluated object."""
    evaluated = drawn.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    if mesh is None:  # a curve without a point
        return np.empty((0, 3)), np.empty((0, 2), np.int32)
    try:
        points = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", points.ravel())
        edges = np.empty((len(mesh.edges), 2), np.int32)
        mesh.edges.foreach_get("vertices", edges.ravel())
        is_loose = np.empty(len(mesh.edges), bool)
        mesh.edges.foreach_get("is_loose", is_loose)
    finally:
        evaluated.to_mesh_clear()
    return points.astype(np.float64), edges[is_loose]


def _read_curves(curves):
    """Return (N, 3) float64 points and (L, 2) segments between the control points of a Curves datablock."""
    points = np.empty((len(curves.points), 3), np.float32)
    if len(points):
        curves.attributes["position"].data.foreach_get("vector", points.ravel())
    offsets = curve_offsets(curves)
    is_cyclic = np.zeros(len(curves.curves), bool)
    if (attribute := curves.attributes.get("cyclic")) is not None:
        attribute.data.foreach_get("value", is_cyclic)
    follows = np.ones(len(points), bool)
    follows[offsets[1:] - 1] = False
    starts = np.flatnonzero(follows)
    closing = is_cyclic & (np.diff(offsets) > 2)
    ends = np.stack([offsets[1:] - 1, offsets[:-1]], axis=1)[closing]
    return points.astype(np.float64), np.concatenate([np.stack([starts, starts + 1], axis=1), ends])
