# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots reused when guides and hair are regenerated."""

from bpy.types import Curves

from ...core.geometry import mesh
from ...core.geometry.mesh import SurfacePoints
from ..data import scene
from ..data.strands import curves, stored_roots
from ..data.surfaces import Surface, cage_of


def of(target: Curves | None, surface: Surface, key: str, count: int | None) -> SurfacePoints | None:
    """Return the `SurfacePoints` stored by Curves if they were placed by this `root_key` on these faces; else None.

    If the level of subdivision has changed, the points nearest to the strands' first points. count: required number, as
    an artist may have deleted strands.
    """
    if target is None or target.vellus.root_key != key or len(target.curves) != count:
        return None
    if cage_of(target.vellus.topology) != cage_of(surface.topology):
        return None
    on_cage = stored_roots.cage_points(target, surface)
    if on_cage is not None or target.vellus.topology == surface.topology:
        return on_cage
    firsts, shown = surface.from_local(curves.first_points(target)), scene.shown_surface(target.surface, surface)
    if target.vellus.topology == shown.topology:  # their positions before the surface was edited
        stored = stored_roots.points(target, shown, is_complete=True)
        firsts = firsts if stored is None else mesh.positions(shown.mesh, stored)
    return curves.nearest_roots(surface, firsts)
