# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing by code: guides march from their roots along directions that a groom gives, and stay clear of solids."""

from collections.abc import Callable

import bpy
import numpy as np

from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh, normals, positions
from hair_addon.core.grooming.guide_lengths import cut

STEPS = 41  # points of a guide
_TURN = 0.42  # how quickly a guide turns to where it is combed, at each step
_SMOOTHING = 3  # passes over the finished guides

Aim = Callable[[np.ndarray, float], np.ndarray]  # (places (G, 3) [m], part of the length) → directions (G, 3)
Clear = Callable[[np.ndarray, float], np.ndarray]  # the same → places (G, 3)


class Solid:
    """A mesh object, in world space, that hair is kept off."""

    def __init__(self, mesh_object: bpy.types.Object) -> None:
        evaluated = mesh_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh()
        mesh.calc_loop_triangles()
        vertices = np.empty((len(mesh.vertices), 3), np.float32)
        triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
        mesh.vertices.foreach_get("co", vertices.ravel())
        mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
        evaluated.to_mesh_clear()
        matrix = np.array(mesh_object.matrix_world, np.float32)
        self.mesh = TriMesh(vertices @ matrix[:3, :3].T + matrix[:3, 3], triangles)
        self._query = SurfaceQuery(self.mesh)

    def nearest(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points nearest to places (N, 3) [m], and the smooth normals there, (N, 3) each."""
        found = self._query.nearest(places)
        return positions(self.mesh, found), normals(self.mesh, found)

    def clear(self, places: np.ndarray, clearance: np.ndarray | float, slide: np.ndarray | float = 0.0) -> np.ndarray:
        """Places (N, 3) that are at least a clearance [m] above the surface; slide (N, 3): added to the way out."""
        near, normal = self.nearest(places)
        push = np.maximum(clearance - np.einsum("ni,ni->n", places - near, normal), 0.0)
        return places + push[:, None] * (normal + slide)

    def lying(self, places: np.ndarray, height: np.ndarray | float) -> np.ndarray:
        """Return the places (N, 3) at a height [m] above the surface that are nearest to places (N, 3)."""
        near, normal = self.nearest(places)
        return near + np.broadcast_to(height, len(places))[:, None] * normal

    def toward(self, places: np.ndarray, height: np.ndarray | float, reach: float) -> np.ndarray:
        """Directions (N, 3) to a height [m] above the surface; of length one where it is a reach [m] away, or more."""
        near, normal = self.nearest(places)
        off = height - np.einsum("ni,ni->n", places - near, normal)
        return np.clip(off / reach, -1.0, 1.0)[:, None] * normal


def march(roots: np.ndarray, start: np.ndarray, lengths: np.ndarray, aim: Aim, clear: Clear, turn: float = _TURN):
    """Guides (G, STEPS, 3) float32 [m] of lengths (G,) [m] from roots (G, 3), which leave along start (G, 3)."""
    step = (lengths / (STEPS - 1))[:, None]
    place, direction = roots.astype(np.float64), unit(start)
    points = [place]
    for i in range(1, STEPS):
        part = i / (STEPS - 1)
        direction = unit(direction + turn * unit(aim(place, part)))
        ahead = clear(place + step * direction, part)
        direction = unit(ahead - place)
        place = place + step * direction
        points.append(place)
    guides = np.stack(points, axis=1)
    for _pass in range(_SMOOTHING):
        guides[:, 1:-1] = 0.25 * guides[:, :-2] + 0.5 * guides[:, 1:-1] + 0.25 * guides[:, 2:]
    return guides.astype(np.float32)


def cut_at(guides: np.ndarray, is_beyond: np.ndarray) -> np.ndarray:
    """Guides (G, P, 3) cut off where they first enter a region: is_beyond (G, P) bool, of their points."""
    steps = np.linalg.norm(np.diff(guides, axis=1), axis=2)
    along = np.concatenate([np.zeros((len(guides), 1)), np.cumsum(steps, axis=1)], axis=1)
    first = np.where(is_beyond.any(axis=1), is_beyond.argmax(axis=1), guides.shape[1] - 1)
    return cut(guides, along[np.arange(len(guides)), first])


def read(guides: bpy.types.Curves) -> np.ndarray:
    """Return (G, P, 3) float32 [m]: the points of guides on an object that is not moved."""
    points = np.empty((len(guides.points), 3), np.float32)
    guides.attributes["position"].data.foreach_get("vector", points.ravel())
    return points.reshape(len(guides.curves), -1, 3)


def write(guides: bpy.types.Curves, points: np.ndarray) -> None:
    """Give guides other points (G, P, 3) [m]."""
    guides.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(points, np.float32).ravel())
    guides.update_tag()
    bpy.context.view_layer.update()


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return (…, 3) of length one."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def part(value: np.ndarray, low: float, high: float) -> np.ndarray:
    """0 below low, 1 above high, and smooth between them."""
    share = np.clip((np.asarray(value, np.float64) - low) / (high - low), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def mixed(first: np.ndarray, second: np.ndarray, share: np.ndarray | float) -> np.ndarray:
    """Return (N, 3): from first to second, by shares (N,) or one for all."""
    share = np.asarray(share, np.float64)
    share = share[:, None] if share.ndim else share
    return first + share * (second - first)


def columns(*axes: np.ndarray | float) -> np.ndarray:
    """Return (N, 3) of x, y and z, each (N,) or a number; (3,) of three numbers."""
    return np.stack(np.broadcast_arrays(*axes), axis=-1).astype(np.float64)
