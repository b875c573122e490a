# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair kept outside the colliders of its simulated guides when it is written, for renders and exports."""

from dataclasses import replace

from bpy.types import Curves

from ...core import dynamics
from ...core.errors import HairError
from ..data import scene
from ..data.simulation import guide_poses, simulated_world
from ..data.strands import simulated_guides
from ..host import notices, scene_time
from ..settings import preferences, properties
from .bindings import BoundHair

_SKIN = 1e-5  # [m] distance of hair from its own surface


def is_wanted(hair: Curves) -> bool:
    """Whether to keep hair outside: the setting is on and simulated guides are shown."""
    guides = hair.vellus.guide_curves
    return guides is not None and guides.vellus.dynamics.keeps_hair_outside and simulated_guides.is_shown(guides)


def keep_outside(hair: Curves, bound: BoundHair) -> None:
    """Move strands out of the surface and the colliders of their guides before they are written."""
    bound.restore_points()
    if not is_wanted(hair):
        return
    try:
        settings = properties.dynamics_of(hair.vellus.guide_curves.vellus)
        blender_scene, depsgraph = scene_time.present_scene(), scene.present_depsgraph()
        meters = simulated_world.meters_of(blender_scene, settings)
        pose = guide_poses.read(hair, depsgraph, meters)
        ways = bound.points[:, 1] - bound.points[:, 0]
        world, _errors = simulated_world.read(blender_scene, depsgraph, settings, pose, hair.surface, ways)
        obstacles = [replace(one, distance=_SKIN) if one.vertices is pose.vertices else one for one in world.obstacles]
        there = pose.to_world(bound.points)
        moved, is_moved = dynamics.outside.moved_outside(there, obstacles, preferences.device())
    except HairError as error:
        notices.say(str(error))
        return
    if is_moved.any():
        corrected = bound.points.copy()
        corrected[is_moved, 1:] = pose.to_rest(moved)[is_moved, 1:]
        bound.override_points(corrected)
