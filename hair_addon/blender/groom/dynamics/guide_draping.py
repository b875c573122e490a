# SPDX-License-Identifier: GPL-3.0-or-later
"""Draping: combed guides fall on their surface and take their resting shape."""

from dataclasses import replace

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import dynamics, grooming
from ....core.geometry.mesh import TriMesh
from ....core.grooming import cost
from ....core.grooming.guide_tool_settings import DrapeSettings
from ....core.long_work import Work, part_of, run_now
from ...data.simulation import simulated_world, wet_guides
from ...host.datablocks import Remembered
from ...settings import preferences, properties
from ..guides import guide_tools
from . import guide_simulation

LEAST_STIFFNESS = 1e-3  # lower limit of the bend stiffness
_FRAMES = 24.0  # per second, with the number of substeps of the settings


def drape(datablock: Curves, settings: DrapeSettings, depsgraph: Depsgraph) -> int:
    """Let guides fall on their deformed surface until they are at rest; returns the number of changed guides.

    Raises `HairError` before anything changes.
    """
    return run_now(draping(datablock, settings, depsgraph))


def draping(datablock: Curves, settings: DrapeSettings, depsgraph: Depsgraph) -> Work[int]:
    """Run `drape` as work in steps; guides are unchanged until all are at rest."""
    guides = guide_tools.read(datablock, settings, depsgraph)
    dynamics_settings = _softened(datablock, settings)
    blender_scene = depsgraph.scene
    gravity = tuple(blender_scene.gravity) if blender_scene.use_gravity else simulated_world.NO_GRAVITY
    meters = simulated_world.meters_of(blender_scene, dynamics_settings)
    dynamics_settings = guide_simulation.in_meters(dynamics_settings, meters)
    posed, surface = guides.posed(), guides.surface
    wetness = wet_guides.of_guides(datablock, surface, depsgraph, {}, guides.roots)
    mesh = TriMesh(surface.posed_mesh.vertices * np.float32(meters), surface.posed_mesh.triangles)
    device, remembered, falling = preferences.device(), Remembered(datablock), guide_tools.to_shape(guides)

    def compute(progress):
        dynamics.draped_growth.load_kernels(device, part_of(progress, 0.0, 0.1))
        settled = []
        for index, (chosen, places) in enumerate(falling):
            own = part_of(progress, *(0.1 + 0.9 * part / len(falling) for part in (index, index + 1)))

            def tell(part, own=own):
                own("Draping guides", part)

            points = meters * posed[places].astype(np.float64)
            given = points, mesh, dynamics_settings, gravity, settings.seconds, device, tell
            settled.append(dynamics.draping.draped(*given, wetness=None if wetness is None else wetness[chosen]))
        return settled

    settled = yield compute
    after = guides.points.copy()
    for (chosen, places), points in zip(falling, settled, strict=True):
        at_rest = guides.carried_back((points / meters).astype(np.float32), chosen)
        after[places] = grooming.guide_shapes.blended(guides.points[places], at_rest, guides.weights[chosen])
    return guide_tools.write_shapes(replace(guides, datablock=remembered.find()), after)


def seconds(datablock: Curves, settings: DrapeSettings, face_count: int) -> float:
    """Estimated duration of `drape` [s]; face_count: triangles of the surface."""
    substeps = properties.dynamics_of(datablock.vellus).substeps * _FRAMES * settings.seconds
    return cost.drape_seconds(len(datablock.curves), face_count, round(substeps))


def _softened(datablock, settings):
    """Return the `DynamicsSettings` of guides with the stiffness for draping."""
    present = properties.dynamics_of(datablock.vellus)
    return replace(present, bend_stiffness=max(settings.stiffness * present.bend_stiffness, LEAST_STIFFNESS))
