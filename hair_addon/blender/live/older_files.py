# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of older files on subdivided surfaces.

Older versions rotated strands with the flat faces of the cage; this version rotates them with its smooth surface
(smooth_surface.py). Rest points are moved so that strands stay in place. Live hair is computed again between its
guides, which keeps neighboring strands together.
"""

import bpy
import numpy as np

from ...core import geometry
from ...core.errors import HairError
from ..data import scene
from ..data.strands import curves, follow_nodes, posed_strands, stored_roots


def renew():
    """Update strands of older files on subdivided surfaces; linked strands stay as they are."""
    older = [o for o in bpy.data.objects if o.type == "CURVES" and o.library is None and follow_nodes.is_older(o)]
    found = {o.data.session_uid: o.data for o in older if o.data.library is None}
    read = []  # all strands are read before any are written: writing guides regenerates their hair
    for datablock in found.values():
        try:
            read.append((datablock, *_seen(datablock)))
        except HairError:
            continue  # the next update of the hair reports the error
    for datablock, surface, points in read:
        if points is not None:
            _write(datablock, surface, points)


def _seen(datablock):
    """Return the surface of strands and the (N, 3) rest points that keep them in place; (None, None) for no change.

    Raises `HairError`.
    """
    surface_object, unchanged = datablock.surface, (None, None)
    if datablock.vellus.kind not in {"GUIDES", "HAIR"} or surface_object is None or surface_object.type != "MESH":
        return unchanged
    surface = scene.read_surface(surface_object, scene.present_depsgraph())
    places = stored_roots.places(datablock, len(surface.rest))
    if surface.cage_corners == 0 or surface.topology != datablock.vellus.topology or places is None:
        return unchanged
    at_rest, counts = curves.read_points(datablock), curves.point_counts(datablock)
    pose = posed_strands.pose_of(surface)
    if not pose.is_deformed:
        return surface, at_rest
    before = geometry.surface_deform.motion(surface.rest, surface.posed, surface.faces)
    seen = posed_strands.carried(at_rest, before, places, counts)
    points = posed_strands.carried(seen, pose.motion_at(places[0]), places, counts, is_back=True)
    is_rooted = np.repeat(places[1].any(axis=1), counts)
    return surface, np.where(is_rooted[:, None], points, at_rest)


def _write(datablock, surface, points):
    curves.write_moved(datablock, points)
    is_combed = datablock.vellus.kind == "GUIDES" and surface.corner_uvs is not None
    for user in bpy.data.objects:
        if user.data == datablock and user.library is None:
            follow_nodes.set_surface(user, datablock.surface, len(surface.rest), is_combed, surface.cage_corners)
