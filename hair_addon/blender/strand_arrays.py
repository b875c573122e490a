# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair as arrays in the world, for what reads them outside Blender."""

import bpy
import numpy as np

from ..core import strands
from ..core.errors import HairError
from . import curves, live_hair, scene, selection

_AT_ONCE = 16_384  # strands, in double precision: all of them would take four times their memory


def metres_per_unit(blender_scene):
    """How many metres a unit of a scene is."""
    units = blender_scene.unit_settings
    return 1.0 if units.system == "NONE" else units.scale_length


def world_points(datablock):
    """(S, P, 3) float32 [m]: a Curves datablock's points in Blender's axes, where its surface carries them now.

    As Vellus makes them, without what other modifiers do. Where numbers of points differ all have the largest.
    """
    live_hair.write_all()
    shown = selection.object_of(datablock, bpy.context.view_layer)
    if shown is None:
        raise HairError('No object of the view layer shows "{name}".', name=datablock.name)
    local = _carried(datablock, _at_rest(datablock))
    to_world = np.array(shown.matrix_world, np.float64) * metres_per_unit(bpy.context.scene)
    world = np.empty_like(local)
    for start in range(0, len(local), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        world[some] = local[some].astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
    return world


def _at_rest(datablock):
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError('"{name}" has no strands.', name=datablock.name)
    points, most = curves.read_points(datablock), int(counts.max())
    if (counts == most).all():
        return points.reshape(-1, most, 3)
    return strands.resample(points, np.concatenate([[0], np.cumsum(counts)]), most)


def _carried(datablock, points):
    if datablock.surface is None:
        return points
    surface = scene.read_surface(datablock.surface, bpy.context.evaluated_depsgraph_get())
    if not surface.is_deformed:
        return points
    from ..core import surface_frames  # Warp takes longer to import than the add-on may take to start

    motion = surface_frames.motion(surface.rest, surface.posed, surface.faces)
    return surface_frames.carry(points, motion, *curves.root_places(datablock, surface))
