# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that stay as they are seen where a transform is applied to a surface that is deformed.

Strands turn rigidly with their surface in its local coordinates, which are other ones then: what turned by some angle
in a space that is stretched turns by another in one that is not. Turns of vertices are blended by two of their axes,
so a turn of the coordinates alone counts too: 3e-4 of the surface's size on one of 160 faces.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from bpy.types import Curves

from ...core.geometry.affine import Affine
from ..data.strands import curves, posed_strands, stored_roots
from ..data.surfaces import Surface

Points = Callable[[np.ndarray], np.ndarray]


def kept_by(strands: Curves, surface: Surface, change: Affine) -> Points | None:
    """A function of (N, 3) points of strands at rest that an `Affine` was applied to: where they are to be at rest.

    None where they stay as they are. surface: to which it was applied.
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
