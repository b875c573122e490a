# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides that settle under gravity on a surface that stands still: a groom that hangs and lies where it was grown."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry import closest_point
from ..geometry.mesh import TriMesh
from .collision import closed_parts
from .rod import rotations
from .rod.settings import DynamicsSettings
from .root_motion import RootPose
from .simulation import MOST_SUBSTEPS, Obstacle, Simulation, World

# Of an animation's frames, as reading the surface takes a while for each.
_FRAMES = 4
FRAME = _FRAMES / 24.0  # [s]
REST = 5e-3  # [m/s] below which guides are at rest
_DAMPING = 0.05  # [s]
_DRAG = 4.0  # times that of air: equilibria stay, and are come to sooner


def draped(
    points: np.ndarray,
    mesh: TriMesh,
    settings: DynamicsSettings,
    gravity: tuple[float, float, float],
    seconds: float,
    device: wp.DeviceLike = None,
    tell: Callable[[float], None] = lambda _part: None,
    *,
    wetness: np.ndarray | None = None,
) -> np.ndarray:
    """Guides (G, P, 3) [m] → (G, P, 3) float64 where they come to rest, or after some seconds if they do not before.

    mesh: the surface that they grow on and lie upon; gravity: [m/s²]; tell: called with the part that is done, and may
    raise to stop; wetness: as `Simulation` takes it. Raises `HairError`, also for a surface that nothing collides with.
    """
    pose = RootPose(np.asarray(points[:, 0], np.float64), np.tile(rotations.IDENTITY, (len(points), 1)))
    vertices, triangles = mesh.vertices.astype(np.float64), _facing(mesh, points)
    surface = Obstacle("surface", vertices, triangles, settings.friction, settings.collision_distance)
    world = World(gravity, (surface,))
    falling = replace(
        settings,
        sag_free=False,
        hold=0.0,
        hair_friction=0.0,
        hair_pressure=0.0,
        inertia=1.0,
        damping=max(settings.damping, _DAMPING),
        air_drag=max(settings.air_drag, 1.0) * _DRAG,
        substeps=min(settings.substeps * _FRAMES, MOST_SUBSTEPS),
    )
    tell(0.0)
    simulation = Simulation(points, falling, pose, world, device, wetness=wetness)
    for note in simulation.notes:
        raise HairError("Guides cannot be draped on this surface: {cause}.", cause=note.values["cause"])
    before, count = simulation.vertices(), max(round(seconds / FRAME), 1)
    for frame in range(count):
        tell(frame / count)
        simulation.advance(pose, world, FRAME)
        there = simulation.vertices()
        if np.linalg.norm(there - before, axis=2).max() < REST * FRAME:
            break
        before = there
    return simulation.points()


def _facing(mesh, points):
    """(F, 3) triangles of a mesh, where it is open with the hair (G, P, 3) in front of it."""
    parts = closed_parts.open_parts(mesh)
    if (parts < 0).all():
        return mesh.triangles
    nearest = closest_point.SurfaceQuery(mesh).nearest(points[:, 0])
    return closed_parts.facing_hair(mesh, parts, mesh.triangles[nearest.triangle], points[:, 1] - points[:, 0])
