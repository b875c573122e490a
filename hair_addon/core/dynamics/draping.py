# SPDX-License-Identifier: GPL-3.0-or-later
"""Draping: guides settle under gravity on a static surface."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry.mesh import TriMesh
from .collision import closed_parts
from .rod import rotations
from .rod.settings import DynamicsSettings
from .root_motion import RootPose
from .simulation import MOST_SUBSTEPS, Obstacle, Simulation, World

# Animation frames in a simulated frame: reading the surface for each animation frame would be slow.
_FRAMES = 4
FRAME = _FRAMES / 24.0  # [s]
REST = 5e-3  # speed below which guides are at rest [m/s]
_DAMPING = 0.05  # [s]
_DRAG = 4.0  # factor of air drag: guides reach the same equilibria sooner


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
    """Simulate guides (G, P, 3) [m] until they rest, for at most `seconds`; returns (G, P, 3) float64.

    mesh: the surface on which guides grow and lie; gravity: [m/s²]; tell: called with the completed fraction, may raise
    to cancel; wetness: as in `Simulation`. Raises `HairError`, also if the surface is unusable as a collider.
    """
    pose = RootPose(np.asarray(points[:, 0], np.float64), np.tile(rotations.IDENTITY, (len(points), 1)))
    vertices, triangles = (
        mesh.vertices.astype(np.float64),
        closed_parts.facing_strands(mesh, points[:, 0], points[:, 1]),
    )
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
        after = simulation.vertices()
        if np.linalg.norm(after - before, axis=2).max() < REST * FRAME:
            break
        before = after
    return simulation.points()
