# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that keep their posed shape when a transform is applied to a deformed surface.

Strands rotate rigidly with their surface in its local coordinates. Applying a transform changes these coordinates: a
rotation in a stretched space is another rotation without the stretch. Even a rotation of the coordinates alone matters,
as rotations of vertices are blended by two of their axes: 3e-4 of the size of a surface with 160 faces.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from bpy.types import Curves

from ....core.geometry.affine import Affine
from ...data.strands import curves, posed_strands, stored_roots
from ...data.surfaces import Surface

Points = Callable[[np.ndarray], np.ndarray]


def rest_correction(strands: Curves, surface: Surface, change: Affine) -> Points | None:
    """Return a function that moves (N, 3) rest points of strands so that their posed shape before `change` is kept.

    None if they do not move. surface: the one to which the `Affine` was applied.
    """
    if not surface.is_deformed or change.is_uniform_scale or not len(strands.curves):
        return None
    back = change.inverse
    before = replace(
        surface,
        rest=back.points(surface.rest),
        posed=back.points(surface.posed),
        smooth_rest=back.points(surface.smooth_rest),
    )
    pose = posed_strands.pose_of(surface)
    stored, may_start_off_surface = stored_roots.slid_places(strands), stored_roots.may_start_off_surface(strands)
    firsts = curves.first_points(strands)
    vertices, weights, *slides = pose.rooted(strands.vellus.topology, stored, firsts, may_start_off_surface)
    motions = [one.motion_at(vertices) for one in (posed_strands.pose_of(before), pose)]
    counts, places = curves.point_counts(strands), (vertices, weights)
    slide = np.repeat(slides[0], counts, axis=0) if slides else np.zeros((1, 3), np.float32)
    starts = curves.curve_offsets(strands)[:-1]

    def kept(points):
        if len(points) != counts.sum():
            return points
        seen = posed_strands.carried(back.points(points + slide), motions[0], places, counts)
        now = posed_strands.carried(change.points(seen), motions[1], places, counts, is_back=True)
        now = now - slide
        if not may_start_off_surface:
            now[starts] = points[starts]  # exactly where strands are rooted
        return now

    return kept
