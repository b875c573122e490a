# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides on an edited mesh: transformed with the surface, or rooted again if its faces changed."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core import geometry
from ...core.geometry.mesh import require_finite
from ..data import scene
from ..data.strands import curves, curves_objects, kept_shapes, posed_strands
from . import bindings

_ROOTED_AGAIN = {
    "GUIDES": 'The faces of "{name}" have changed: guides are rooted at the nearest points.',
    "HAIR": 'The faces of "{name}" have changed: strands are rooted at the nearest points.',
}


def follow_surface(guide_curves: Curves, depsgraph: Depsgraph, axes_before: np.ndarray | None = None) -> bool:
    """Carry guides, combed or not, or hair that is kept as it came, with an edited surface; whether it was edited.

    axes_before: `to_world_axes` of the surface before the edit, None if unknown. Shape keys and modifiers are not
    edits: strands are stored on the surface at rest. If faces were added or removed, roots move to the nearest
    points. Raises `HairError`, for linked guides only if they would change.
    """
    state = guide_curves.vellus
    surface = scene.read_surface(guide_curves.surface, depsgraph)
    roots = curves.read_root_places(guide_curves, len(surface.rest))
    stored = curves.stored_roots(guide_curves, surface)
    if state.topology != surface.topology or roots is None or stored is None:
        curves.require_not_linked(guide_curves)
        _root_again(guide_curves, surface)
        state.status = _ROOTED_AGAIN[state.kind].format(name=surface.name)
        return True
    before = curves.stood_on(guide_curves)
    if before is None or before.shape != surface.rest.shape or np.array_equal(before, surface.rest):
        return False
    curves.require_not_linked(guide_curves)
    require_finite(surface.rest)
    applied = None if axes_before is None else np.linalg.solve(surface.to_world_axes, axes_before)
    if applied is not None and np.allclose(before @ applied.T, surface.rest, rtol=0.0, atol=1e-5 * surface.extent):
        # The object's rotation or scale was applied: nothing has moved in world space.
        followers = [hair for hair in curves.followers(guide_curves) if not curves.is_hand_made(hair)]
        for target in (guide_curves, *followers):
            kept_shapes.move(target, lambda points: points @ applied.T)
            curves_objects.clear_parent_inverse(target)
            bindings.invalidate(target)
    else:
        motion = geometry.surface_deform.motion(before, surface.rest, surface.faces, roots[0])
        counts = curves.point_counts(guide_curves)
        kept_shapes.move(guide_curves, lambda points: posed_strands.carried(points, motion, roots, counts))
    curves.write_roots(guide_curves, surface, stored)
    curves.keep_surface(guide_curves, surface)
    return True


def _root_again(guide_curves, surface):
    points = surface.from_local(curves.first_points(guide_curves))
    curves.write_roots(guide_curves, surface, curves.read_roots(guide_curves, surface, points))
    curves.keep_surface(guide_curves, surface)
