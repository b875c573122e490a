# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic surfaces that strands touch: contact planes between the stages of substeps."""

from dataclasses import dataclass

import numpy as np

from hair_addon.core.dynamics.rod import rod_solver
from hair_addon.core.dynamics.rod.rod_solver import FINISH, PREDICT, SOLVE, Surroundings
from tests.support.devices import DEVICE
from tests.support.dynamics.rods import in_lanes


@dataclass(frozen=True)
class Plane:
    """A plane through the origin."""

    normal: tuple = (0.0, 0.0, 1.0)

    def heights_and_normals(self, points):
        """Return the heights (…,) [m] above the surface, and its normals (…, 3)."""
        return points @ np.array(self.normal), np.broadcast_to(self.normal, points.shape)


@dataclass(frozen=True)
class Ball:
    """A sphere, or a cylinder along axes whose entries are zero."""

    radius: float
    axes: tuple = (1.0, 1.0, 1.0)
    center: tuple = (0.0, 0.0, 0.0)

    def heights_and_normals(self, points):
        across = (points - self.center) * self.axes
        distances = np.linalg.norm(across, axis=-1)
        return distances - self.radius, across / distances[..., None]


def planes_of(surface, points, keep, friction, slide=(0.0, 0.0, 0.0)):
    """Return planes (S, N, 8) of points (S, N, 3) within 5 cm; friction: of each strand."""
    heights, normals = surface.heights_and_normals(points)
    planes = np.zeros((*points.shape[:2], rod_solver.PLANE_ROWS))
    is_near = (heights < 0.05)[..., None]
    planes[..., :3] = np.where(is_near, normals, 0.0)
    planes[..., 3] = np.sum(points * normals, axis=-1) - heights + keep
    planes[..., 4:7] = slide
    planes[..., 7] = np.broadcast_to(np.reshape(friction, (-1, 1)), heights.shape)
    return planes


def advance_touching(simulation, surface, frames=1, friction=0.3, keep=5e-4, root_speed=(0.0, 0.0, 0.0), each=None):
    """Simulate frames in which strands touch a surface; each(): called after every substep."""
    rods, step = simulation.rods, simulation.step
    for _ in range(frames):
        simulation.roots = simulation.roots + np.multiply(root_speed, step.size * step.count)
        rods.move_roots(simulation.roots)
        for substep in range(step.count):
            for stage in (PREDICT, SOLVE, FINISH):
                around = Surroundings()
                if stage != PREDICT:
                    found = planes_of(surface, rods.positions().astype(float), keep, friction)
                    around = Surroundings(in_lanes(found, DEVICE))
                rods.advance(step, substep, substep + 1, stage, around)
            if each is not None:
                each()
