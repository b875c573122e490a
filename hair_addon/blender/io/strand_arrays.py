# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair as arrays in world space, for export."""

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.geometry import strands
from ..data import curves, posed_strands
from ..groom import selection
from ..host.notices import name_of
from ..live import live_hair

_AT_ONCE = 16_384  # strands, in double precision: all of them would take four times their memory


def metres_per_unit(blender_scene):
    """Metres per unit of a scene."""
    units = blender_scene.unit_settings
    return 1.0 if units.system == "NONE" else units.scale_length


def world_points(datablock):
    """(S, P, 3) float32 [m]: a Curves datablock's points in Blender's axes, where its surface carries them now.

    Without other modifiers than ours. Curves of different point counts are resampled to the largest.
    """
    live_hair.write_all()
    bpy.context.view_layer.update()  # new objects may not be evaluated yet
    shown = selection.object_of(datablock, bpy.context.view_layer)
    if shown is None:
        raise HairError('"{name}" has no object in this view layer.', name=name_of(datablock))
    pose = posed_strands.read_pose(datablock.surface, bpy.context.evaluated_depsgraph_get())
    local = pose.carry(_at_rest(datablock), datablock.vellus.topology, curves.read_root_places(datablock, np.inf))
    to_world = np.array(shown.matrix_world, np.float64) * metres_per_unit(bpy.context.scene)
    world = np.empty_like(local)
    for start in range(0, len(local), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        world[some] = local[some].astype(np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
    return world


def _at_rest(datablock):
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError('"{name}" has no strands.', name=name_of(datablock))
    points, most = curves.read_points(datablock), int(counts.max())
    if (counts == most).all():
        return points.reshape(-1, most, 3)
    return strands.resample(points, curves.curve_offsets(datablock), most)
