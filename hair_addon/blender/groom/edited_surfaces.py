# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides on an edited mesh: transformed with the surface, and rooted again where faces have changed."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core import geometry
from ...core.geometry.mesh import require_finite
from ..data import scene
from ..data.strands import curves, curves_objects, kept_shapes, stored_roots
from . import bindings, edited_faces

_ROOTED_AGAIN = {
    "GUIDES": '{guides} guides and {strands} strands lost their faces of "{name}": rooted at the nearest points.',
    "HAIR": '{strands} strands lost their faces of "{name}": rooted at the nearest points.',
}


def follow_surface(guide_curves: Curves, depsgraph: Depsgraph, axes_before: np.ndarray | None = None) -> bool:
    """Carry guides, combed or not, or hair that is kept as it came, with an edited surface; whether it was edited.

    axes_before: `to_world_axes` of the surface before the edit, None if unknown. Shape keys and modifiers are not
    edits: strands are stored on the surface at rest. Roots whose face is gone move to the nearest points. Raises
    `HairError`, for linked guides only if they would change.
    """
    state = guide_curves.vellus
    surface = scene.read_surface(guide_curves.surface, depsgraph)
    roots = stored_roots.places(guide_curves, len(surface.rest))
    stored = stored_roots.points(guide_curves, surface)
    if state.topology != surface.topology or roots is None or stored is None:
        curves.require_not_linked(guide_curves)
        lost, lost_between = edited_faces.root_again(guide_curves, surface, depsgraph)
        if lost or lost_between:
            strand_count = lost_between if state.kind == "GUIDES" else lost
            sentence = _ROOTED_AGAIN[state.kind]
            state.status = sentence.format(name=surface.name, guides=lost, strands=strand_count)
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
        edited_faces.carry(guide_curves, surface, motion, roots, stored)
    curves.write_roots(guide_curves, surface, stored)
    curves.keep_surface(guide_curves, surface)
    return True
