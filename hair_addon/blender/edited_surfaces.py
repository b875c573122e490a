# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides on a surface whose mesh was edited: carried with it, or rooted anew where its faces are others."""

import numpy as np

from ..core.mesh import require_finite
from . import bindings, curves, scene


def follow_surface(guide_curves, depsgraph, axes_before=None):
    """Carry guides, combed or not, with a surface that was edited; whether it was. Raises `HairError`.

    axes_before: `to_world_axes` of the surface before the edit, None if nobody knows. Shape keys and modifiers are no
    edits: strands are stored on the surface at rest. Where faces came or went, roots are found again at the nearest
    place.
    """
    state = guide_curves.vellus
    surface = scene.read_surface(guide_curves.surface, depsgraph)
    if state.topology != surface.topology:
        _root_again(guide_curves, surface)
        state.status = f'The faces of "{surface.name}" have changed: guides are rooted where it is nearest.'
        return True
    before = curves.stood_on(guide_curves)
    if before is None or before.shape != surface.rest.shape or np.array_equal(before, surface.rest):
        return False
    require_finite(surface.rest)
    applied = None if axes_before is None else np.linalg.solve(surface.to_world_axes, axes_before)
    if applied is not None and np.allclose(before @ applied.T, surface.rest, rtol=0.0, atol=1e-5 * surface.extent):
        # The object's rotation or scale was applied: in the world nothing has moved.
        for target in (guide_curves, *curves.followers(guide_curves)):
            curves.transform(target, applied)
            bindings.forget(target)
    else:
        from ..core import surface_frames  # Warp takes longer to import than the add-on may take to start

        vertices, _barycentric = curves.read_root_places(guide_curves)
        curves.carry(guide_curves, surface_frames.motion(before, surface.rest, surface.faces, vertices))
    curves.write_roots(guide_curves, surface, curves.stored_roots(guide_curves, surface))
    curves.keep_surface(guide_curves, surface)
    return True


def _root_again(guide_curves, surface):
    counts = curves.point_counts(guide_curves)
    firsts = np.concatenate([[0], np.cumsum(counts[:-1])])
    points = surface.from_local(curves.read_points(guide_curves)[firsts])
    curves.write_roots(guide_curves, surface, curves.read_roots(guide_curves, surface, points))
    curves.keep_surface(guide_curves, surface)
