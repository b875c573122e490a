# SPDX-License-Identifier: GPL-3.0-or-later
"""Draping of guides after growth: new hair hangs, and lies on its surface instead of passing through it.

A surface of any size is simulated like a human scalp, because all lengths of new hair are proportional to the surface
(grooming/groom_defaults.py). Hair of a giant and of a mouse thus looks alike. Gravity is a setting of the guides; the
scene's gravity has no effect.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from .. import grooming
from ..geometry.curves import resampling
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import TriMesh, positions
from ..geometry.mirror import ACROSS_X, Mirror
from ..geometry.strands import Strands, from_numpy
from ..grooming import groom_defaults
from ..grooming.groom import GuideSettings, distribute_guides
from ..kernels import kernel_setup
from ..long_work import Progress, no_progress, part_of
from . import draping
from .collision import contact_queries, contact_substep
from .rod import detail, rod_solver, rods
from .rod.settings import DynamicsSettings

SCALP = 0.055  # area of a human scalp [m²]
# Loose hair, two millimeters from the skin: guides represent wisps, whose strands lie beside the guides.
_HAIR = DynamicsSettings(bend_stiffness=0.5, collision_distance=2e-3, substeps=2)
_SECONDS = 1.0
_EARTH = 9.81  # [m/s²]
_GROWN = 0.6  # fraction of the progress that growth takes; draping takes the rest


def grow(mesh: TriMesh, settings: GuideSettings, *, progress: Progress = no_progress, **ground: Any) -> Strands:
    """Return the guides of `groom.distribute_guides`, draped if the settings enable it.

    Arguments as in `groom.distribute_guides`. Raises `HairError`.
    """
    if not settings.drape:
        return distribute_guides(mesh, settings, progress=progress, **ground)
    guides = distribute_guides(mesh, settings, progress=part_of(progress, 0.0, _GROWN), **ground)
    mask = ground.get("density"), ground.get("texture")
    settings = groom_defaults.complete(settings, mesh, *mask)
    mirror = ground.get("mirror", ACROSS_X)
    return settled(guides, mesh, settings, *mask, mirror=mirror, progress=part_of(progress, _GROWN, 1.0))


def settled(
    guides: Strands,
    mesh: TriMesh,
    settings: GuideSettings,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    *,
    mirror: Mirror = ACROSS_X,
    progress: Progress = no_progress,
) -> Strands:
    """Return grown guides of a mesh after they have settled. settings: completed for the mesh.

    Other arguments as in `groom.distribute_guides`. Raises `HairError` if guides cannot be draped.
    """
    device = guides.points.device
    load_kernels(device, progress)
    meters = math.sqrt(SCALP / groom_defaults.grown_area(mesh, density, texture))  # per unit of the mesh
    gravity = (0.0, 0.0, -_EARTH * groom_defaults.known(settings.gravity))
    used, triangles = np.unique(mesh.triangles[within_reach(mesh, settings, density)], return_inverse=True)
    center = mesh.vertices[used].mean(axis=0, dtype=np.float64)
    surface = TriMesh(
        (meters * (mesh.vertices[used] - center)).astype(np.float32), triangles.reshape(-1, 3).astype(np.int32)
    )
    grown = guides.numpy()

    def report(part):
        progress("Draping guides", part)

    points = draping.draped(meters * (grown - center), surface, _HAIR, gravity, _SECONDS, device, report)
    points = (points / meters + center).astype(np.float32)
    points[:, 0] = grown[:, 0]  # roots stay bit-identical
    if settings.symmetric:
        points = grooming.guide_growth.mirrored(points, positions(mesh, guides.roots), mirror)
    return from_numpy(points, guides.roots, device)


def within_reach(mesh: TriMesh, settings: GuideSettings, density: np.ndarray | None = None) -> np.ndarray:
    """Return (F,) bool: triangles within a guide's length of the bounding box of the grown area.

    settings: completed for the mesh; density: as in `groom.distribute_guides`.
    """
    grown_on = mesh.vertices if density is None else _corners_with(mesh, np.asarray(density) > 0.0)
    reach = groom_defaults.known(settings.length) * (1.0 + settings.length_variation)
    low, high = grown_on.min(axis=0) - reach, grown_on.max(axis=0) + reach
    return ((mesh.corners.max(axis=1) >= low) & (mesh.corners.min(axis=1) <= high)).all(axis=1)


def _corners_with(mesh, is_chosen):
    """Return the corners (N, 3) of the triangles with a chosen vertex."""
    return mesh.corners[is_chosen[mesh.triangles].any(axis=1)].reshape(-1, 3)


def load_kernels(
    device: wp.DeviceLike, progress: Progress = no_progress, most_threads: int = kernel_setup.MOST_THREADS
) -> None:
    """Load the kernels of `settled`; arguments as in `groom.load_kernels`."""
    on_device = [contact_queries, detail, rods, resampling]
    on_device += [contact_substep] if wp.get_device(device).is_cpu else [rod_solver]
    modules = [wp.get_module(module.__name__) for module in on_device]
    kernel_setup.load(modules, device, progress, most_threads)
