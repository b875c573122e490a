# SPDX-License-Identifier: GPL-3.0-or-later
"""Partings: vertex groups, integer attributes and curves → regions and line segments."""

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from ...core import interpolation
from ...core.errors import HairError
from ...core.interpolation.regions import Regions
from . import scene
from .curves import curve_offsets

_WHOLE = {"INT", "INT8", "BOOLEAN"}
_POINT_LIMIT = 10_000  # of part lines: each strand reads all


@dataclass(frozen=True)
class Partings:
    """regions: tuple of `Regions`; lines: (L, 2, 3) float64 [m] as a `Surface` is, or None."""

    regions: tuple
    lines: np.ndarray | None

    @property
    def key(self):
        """A key that changes with them; empty for none."""
        if not self.regions and self.lines is None:
            return ""
        digest = hashlib.blake2b(digest_size=16)
        for array in (*(part for r in self.regions for part in (r.corners, r.guides)), self.lines):
            digest.update(b"-" if array is None else array.tobytes())
        return digest.hexdigest()


def is_wanted(settings):
    """Whether `HairSettings` (or their properties) name anything that parts hair."""
    return bool(settings.region_group or settings.region_attribute or settings.part_lines)


def read(surface_object, surface, guide_curves, settings, depsgraph):
    """The `Partings` that `HairSettings` name, on a `Surface`; guide_curves: None if there are none yet."""
    regions = []
    weights = scene.read_vertex_group(surface_object, depsgraph, settings.region_group)
    if weights is not None:
        regions.append(Regions((weights > 0.5).astype(np.int32)[surface.mesh.triangles]))
    if settings.region_attribute:
        regions.append(_read_numbers(surface_object, surface, guide_curves, settings.region_attribute, depsgraph))
    lines = _read_lines(surface_object, surface, settings.part_lines, depsgraph) if settings.part_lines else None
    return Partings(tuple(regions), lines)


def _read_numbers(surface_object, surface, guide_curves, name, depsgraph):
    corners = guides = None
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            numbers = _whole_numbers(attribute, surface_object.name, ("POINT", "FACE"))
            if attribute.domain == "POINT":
                corners = numbers[surface.mesh.triangles]
            else:
                mesh.calc_loop_triangles()
                faces = np.empty(len(mesh.loop_triangles), np.int32)
                mesh.loop_triangles.foreach_get("polygon_index", faces)
                corners = np.repeat(numbers[faces][:, None], 3, axis=1)
    finally:
        evaluated.to_mesh_clear()
    attribute = None if guide_curves is None else guide_curves.attributes.get(name)
    if attribute is not None:
        guides = _whole_numbers(attribute, guide_curves.name, ("CURVE",))
    if corners is None and guides is None:
        sentence = 'Neither "{name}" nor its guides have an attribute "{attribute}": pick another, or clear the field.'
        raise HairError(sentence, name=surface_object.name, attribute=name)
    return Regions(corners, guides)


def _whole_numbers(attribute, owner, domains):
    """(N,) int32. Raises `HairError` for other types and domains."""
    if attribute.data_type not in _WHOLE or attribute.domain not in domains:
        sentence = 'The attribute "{attribute}" of "{name}" cannot separate hair: use integers on faces or vertices.'
        if "CURVE" in domains:
            sentence = 'The attribute "{attribute}" of "{name}" cannot separate hair: use integers on curves.'
        raise HairError(sentence, attribute=attribute.name, name=owner)
    numbers = np.empty(len(attribute.data), bool if attribute.data_type == "BOOLEAN" else np.int32)
    attribute.data.foreach_get("value", numbers)
    return numbers.astype(np.int32)


def _read_lines(surface_object, surface, name, depsgraph):
    """(L, 2, 3) segments of a curve object, or of a mesh's loose edges."""
    drawn = bpy.data.objects.get(name)
    if drawn is None:
        raise HairError('There is no object "{name}": pick a curve for the part lines, or clear the field.', name=name)
    if drawn.type not in {"CURVE", "CURVES", "MESH"} or (drawn.type == "CURVES" and drawn.data.vellus.kind != "NONE"):
        raise HairError('"{name}" cannot be used as part lines: pick a curve, or clear the field.', name=name)
    points, edges = _read_curves(drawn.data) if drawn.type == "CURVES" else _read_edges(drawn, depsgraph)
    if not len(edges):
        raise HairError('"{name}" has no lines: draw a line of at least two points, without bevel.', name=name)
    if len(edges) > _POINT_LIMIT:
        sentence = '"{name}" has {count} points, too many for part lines: lower its resolution.'
        raise HairError(sentence, name=name, count=len(edges))
    to_local = np.array(surface_object.matrix_world.inverted_safe() @ drawn.matrix_world, np.float64)

    local = points @ to_local[:3, :3].T + to_local[:3, 3]
    return (local @ surface.to_world_axes.T)[interpolation.part_lines.in_order(edges)]


def _read_edges(drawn, depsgraph):
    """(N, 3) float64 points and (L, 2) loose edges of an evaluated object."""
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
    """The same for a Curves datablock: segments between its control points."""
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
