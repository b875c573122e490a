# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair as arrays in world space, for export."""

import bpy
import numpy as np

from ...core import geometry
from ...core.errors import HairError
from ...core.files.groom_curves import Rows, slices
from ...core.geometry import strands
from ...core.grooming import groom
from ..data import scene
from ..data.strands import attributes, curves, exported_curves, posed_strands, stored_roots
from ..groom import selection
from ..host import scene_time
from ..host.notices import name_of
from ..live import live_hair
from . import modified_strands


def meters_per_unit(blender_scene):
    """Meters per unit of a scene."""
    units = blender_scene.unit_settings
    return 1.0 if units.system == "NONE" else units.scale_length


def world_points(datablock):
    """Return (S, P, 3) float32 points [m] of a Curves datablock in Blender's axes, on the present pose of its surface.

    The artist's modifiers are not applied. Curves are resampled to the largest point count, and Catmull-Rom splines to
    at least `POINT_COUNT` points on the curve.
    """
    update_strands()
    return _whole(world_rows(datablock, local=_at_rest(datablock)), shape_of(datablock))


def shown_points(datablock):
    """Like `world_points`, with the artist's modifiers where `modified_strands` provides curves."""
    shown = _shown(datablock)
    if shown is None:
        return world_points(datablock)
    points = _at_rest(shown)
    return _whole(_placed(lambda some: points[some].reshape(-1, 3), _to_world(datablock)), shape_of(datablock))


def _whole(rows, shape):
    world = np.empty(shape, np.float32)
    for some in slices(len(world)):
        world[some] = rows(some).reshape(-1, *shape[1:])
    return world


def counts_of(datablock):
    """Return (S,) int32 point counts of the curves of `world_rows` and `shown_rows`. Raises `HairError`."""
    shape_of(datablock)
    return exported_curves.counts_per_curve(datablock)


def shown_rows(datablock, per_meter=1.0) -> Rows:
    """Like `world_rows`, with the artist's modifiers where `modified_strands` provides curves."""
    shown = _shown(datablock)
    if shown is None:
        return world_rows(datablock, per_meter)
    points = exported_curves.points_per_curve(shown)
    starts = strands.curve_offsets(exported_curves.counts_per_curve(shown))
    return _placed(lambda some: points[starts[some.start] : starts[some.stop]], _to_world(datablock) * per_meter)


def world_rows(datablock, per_meter=1.0, local=None) -> Rows:
    """Return a function of a slice of curves that gives their (N, 3) float32 points [m] times `per_meter`.

    Like `world_points`, but without resampling: point counts are those of `counts_of`. local: (S, P, 3) float32 points
    at rest, None for those of the datablock.
    """
    update_strands()
    if local is None:
        points, counts = exported_curves.points_per_curve(datablock), exported_curves.counts_per_curve(datablock)
    else:
        points, counts = local.reshape(-1, 3), np.full(*local.shape[:2])
    pose = posed_strands.read_pose(datablock.surface, scene.present_depsgraph())
    starts, stored = strands.curve_offsets(counts), stored_roots.slid_places(datablock)
    may_start_off_surface = stored_roots.may_start_off_surface(datablock)
    places = pose.rooted(datablock.vellus.topology, stored, points[starts[:-1]], may_start_off_surface)

    def carried(some):
        its = points[starts[some.start] : starts[some.stop]]
        return pose.carry_rooted(its, counts[some], places, some)

    return _placed(carried, _to_world(datablock) * per_meter)


def _placed(local, to_world) -> Rows:
    """Return local `Rows` transformed by a (4, 4) matrix and to meters."""
    to_file = to_world * meters_per_unit(bpy.context.scene)

    def rows(some):
        return (local(some).astype(np.float64) @ to_file[:3, :3].T + to_file[:3, 3]).astype(np.float32)

    return rows


def _shown(datablock):
    """Return the evaluated Curves of a datablock with artist's modifiers; None without any, or if unusable."""
    update_strands()
    shown = modified_strands.curves_of(datablock)
    return None if shown == datablock else shown


def other_places(datablock):
    """Return [(4, 4) float64] from `world_points` [m] to where other objects of the view layer show them.

    Raises `HairError`.
    """
    layer = bpy.context.view_layer
    shown = selection.object_of(datablock, layer)
    others = [o for o in layer.objects if o != shown and o.type == "CURVES" and o.data == datablock]
    if not others:
        return []
    try:
        back = np.linalg.inv(_to_world(datablock))
    except np.linalg.LinAlgError as error:
        raise HairError('"{name}" has a scale of zero: change its scale.', name=name_of(shown)) from error
    matrices = np.stack([np.array(other.matrix_world, np.float64) @ back for other in others])
    matrices[:, :3, 3] *= meters_per_unit(bpy.context.scene)
    return [*matrices]


def update_strands():
    """Update strands after changes and evaluate new objects."""
    live_hair.write_all()
    with scene_time.outside_drivers():
        bpy.context.view_layer.update()


def shape_of(datablock):
    """Return (S, P, 3), the shape of `world_points`. Raises `HairError` for Curves without strands."""
    counts = curves.point_counts(datablock)
    if not len(counts):
        raise HairError('"{name}" has no strands.', name=name_of(datablock))
    most = int(counts.max())
    if attributes.are_smooth(datablock).any():
        most = max(most, groom.POINT_COUNT)
    return len(counts), most, 3


def world_scale(datablock):
    """Return the mean number of meters per local unit of a Curves datablock. Raises `HairError`."""
    matrix = _to_world(datablock)[:3, :3]
    return float(abs(np.linalg.det(matrix))) ** (1.0 / 3.0) * meters_per_unit(bpy.context.scene)


def _to_world(datablock):
    """Return the matrix (4, 4) float64 from local to world coordinates of the object that shows Curves.

    Guides without an object have that of their surface.
    """
    shown = selection.object_of(datablock, bpy.context.view_layer)
    if shown is None and datablock.vellus.kind == "GUIDES":
        shown = datablock.surface  # new guides lie on it with no transform of their own
    if shown is None:
        raise HairError('"{name}" has no object in this view layer.', name=name_of(datablock))
    return np.array(shown.matrix_world, np.float64)


def _at_rest(datablock):
    strand_count, most, _ = shape_of(datablock)
    points = curves.read_points(datablock)
    if len(points) == strand_count * most:
        return points.reshape(-1, most, 3)
    starts, is_smooth = curves.curve_offsets(datablock), attributes.are_smooth(datablock)
    return geometry.curves.resampling.resample(points, starts, most, is_smooth)
