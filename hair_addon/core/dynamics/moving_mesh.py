# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulation of guides on a mesh whose vertices move from frame to frame, with arrays as input and output."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ..errors import HairError
from ..geometry import mesh as mesh_math
from ..geometry import surface_deform, vertex_turns
from ..geometry.mesh import Faces, TriMesh, require_finite
from ..geometry.strands import Strands
from ..params import array_of
from .collision import closed_parts
from .rod import rotations
from .rod.settings import DynamicsSettings
from .root_motion import RootPose
from .simulation import Obstacle, Simulation, World


def simulated(
    mesh: TriMesh,
    guides: Strands,
    poses: Iterable[ArrayLike],
    settings: DynamicsSettings,
    seconds: float,
    gravity: tuple[float, float, float],
    device: wp.DeviceLike = None,
    *,
    regions: np.ndarray | None = None,
    held: np.ndarray | None = None,
) -> Iterator[np.ndarray]:
    """Yield guides (G, P, 3) float32 [m] for each frame: first as combed, then one frame for each pose.

    mesh: the surface in the first frame; guides: `Strands` on it, checked by `require`; poses: (V, 3) [m] of its
    vertices in the following frames; seconds: duration of a frame; gravity: [m/s²]; regions, held: as in `Simulation`.
    Raises `HairError`.
    """
    surface = _Surface(mesh, guides, settings.size)
    groom = guides.numpy().astype(np.float64)
    scaled = replace(
        settings,
        collision_distance=settings.size * settings.collision_distance,
        cell_size=settings.size * settings.cell_size,
    )

    def world(vertices, number):
        obstacles = (surface.obstacle(vertices, scaled),) if settings.collides_with_surface else ()
        return World(gravity, obstacles, time=number * seconds)

    start, seconds = surface.pose(mesh.vertices), seconds * settings.time_scale
    at_first = world(mesh.vertices, 0)
    simulation = Simulation(settings.size * groom, scaled, start, at_first, device, regions=regions, held=held)
    for _ in range(settings.preroll):
        simulation.advance(start, at_first, seconds)
    yield guides.numpy().copy()
    for number, given in enumerate(poses, start=1):
        vertices = _checked(given, number, len(mesh.vertices))
        simulation.advance(surface.pose(vertices), world(vertices, number), seconds)
        yield (simulation.points() / settings.size).astype(np.float32)


def require(mesh: TriMesh, guides: Strands) -> None:
    """Raise `HairError` unless guides can be simulated on a mesh."""
    mesh_math.check_mesh(mesh)
    mesh_math.check_points(mesh, guides.roots)


def _checked(given, number, vertex_count):
    """Return the vertices (V, 3) float32 of a pose. Raises `HairError` with its number."""
    vertices = array_of(given, np.float32)
    if vertices is None or vertices.shape != (vertex_count, 3) or not np.isfinite(vertices).all():
        raise HairError(f"Pose {number} must be finite numbers of shape ({vertex_count}, 3), as the first one.")
    return vertices


class _Surface:
    """A moving mesh; size: meters per unit of the mesh."""

    def __init__(self, mesh, guides, size):
        self._mesh, self._size = mesh, size
        self._faces = Faces(mesh.triangles.ravel(), np.arange(0, mesh.triangles.size + 1, 3, dtype=np.int32))
        self._places = mesh.triangles[guides.roots.triangle], guides.roots.barycentric
        points = guides.numpy()
        self._ways = points[:, 1] - points[:, 0]
        corners, weights = self._places
        roots = np.einsum("nc,ncx->nx", weights, mesh.vertices[corners])
        self._reach = max(float(np.ptp(mesh.vertices, axis=0).max()), 1e-20)
        # Each root, and three points at a distance from the root along the axes.
        self._crosses = roots[:, None] + self._reach * np.concatenate([np.zeros((1, 3)), np.eye(3)])

    @cached_property
    def _turning(self):
        """The `VertexRotations` of the vertices around roots, for all poses."""
        require_finite(self._mesh.vertices)
        return vertex_turns.turning(self._mesh.vertices, self._faces, self._places[0])

    def pose(self, vertices):
        """Return the `RootPose` of guides for vertices of the mesh."""
        corners, weights = self._places
        positions = np.einsum("nc,ncx->nx", weights.astype(np.float64), vertices.astype(np.float64)[corners])
        motion = surface_deform.turned(self._mesh.vertices, vertices, self._turning)
        posed = surface_deform.carry(self._crosses.astype(np.float32), motion, *self._places).astype(np.float64)
        left, _sizes, right = np.linalg.svd(np.swapaxes(posed[:, 1:] - posed[:, :1], 1, 2))
        return RootPose(self._size * positions, rotations.from_matrices(left @ right))

    @cached_property
    def _triangles(self):
        """Triangles (F, 3); open parts are wound so that the hair is in front of them."""
        parts = closed_parts.open_parts(self._mesh)
        return closed_parts.facing_hair(self._mesh, parts, self._places[0], self._ways)

    def obstacle(self, vertices, settings):
        """Return the mesh as an `Obstacle`."""
        vertices = self._size * vertices.astype(np.float64)
        distance = settings.collision_distance
        return Obstacle("surface", vertices, self._triangles, settings.friction, distance)
