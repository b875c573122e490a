# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that cut guides: the faces of a mesh, or the plane of any other object."""

from dataclasses import dataclass

import bpy
import numpy as np

from ....core.errors import HairError
from ....core.geometry.mesh import TriMesh
from .. import scene


@dataclass(frozen=True)
class Cutter:
    """A mesh [m], or a plane: a point on it [m] and the unit normal towards the side that is cut off, (3,) each.

    Coordinates are relative to a `Surface`.
    """

    mesh: TriMesh | None
    origin: np.ndarray
    normal: np.ndarray


def read_cutter(name, surface_object, depsgraph):
    """Return the `Cutter` of the object of this name for guides on a mesh object. Raises `HairError`."""
    if not name:
        raise HairError("Pick the object that cuts: a mesh, or an empty whose +Z side is cut off.")
    found = bpy.data.objects.get(name)
    if found is None:
        raise HairError('There is no object "{name}": pick another object.', name=name)
    if found == surface_object:
        raise HairError('"{name}" is the surface that the guides grow on: pick another object.', name=name)
    evaluated = found.evaluated_get(depsgraph)
    matrix = np.array(evaluated.matrix_world, np.float64)
    origin = matrix[:3, 3] - np.array(surface_object.matrix_world.translation, np.float64)
    across = np.cross(matrix[:3, 0], matrix[:3, 1])  # perpendicular to the XY plane, even if sheared
    across *= 1.0 if np.dot(across, matrix[:3, 2]) >= 0.0 else -1.0
    size = np.linalg.norm(across)
    if not (np.isfinite(matrix).all() and size > 0.0):
        raise HairError('"{name}" has a scale of zero: change its scale.', name=name)
    mesh = _read_mesh(evaluated, matrix[:3, :3], origin) if found.type == "MESH" else None
    return Cutter(mesh, origin, across / size)


def _read_mesh(evaluated, axes, origin):
    mesh = evaluated.to_mesh()
    try:
        positions = scene.vertex_positions(mesh).astype(np.float64)
        faces = scene.faces_of(mesh)
        corners = scene.triangle_corners(mesh, faces, scene.name_of(evaluated))
        triangles = faces.corner_vertices[corners]
    finally:
        evaluated.to_mesh_clear()
    return TriMesh((positions @ axes.T + origin).astype(np.float32), triangles)
