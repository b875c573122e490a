# SPDX-License-Identifier: GPL-3.0-or-later
"""Data at Blender's last update, to detect what the next update changed."""

import bpy
import numpy as np

from ..data import scene, surface_space
from ..data.strands import curves
from ..host.caches import Cache

# session_uid of guide Curves → their (N, 3) points. Blender reports the geometry of Curves as updated even if only the
# transform of their surface changed.
guide_cache = Cache()

# session_uid of guide Curves → their (N, 3) points before they moved the last time.
former_cache = Cache()

# session_uid of a mesh → its (V, 3) positions at rest, kept for meshes that scripts may edit while frames change.
mesh_cache = Cache()

# session_uid of a surface in Texture Paint mode → True. Blender may not report painting before that mode ends.
painting_cache = Cache()

# session_uid of Curves → the former `Affine` of their surface, which is lost once the surface is deleted or its
# transform is applied.
place_cache = Cache()


def have_guides_moved(guide_curves):
    """Whether guides have moved since the last call for them; True the first time."""
    points = curves.read_points(guide_curves)
    before = guide_cache.get(guide_curves.session_uid)
    guide_cache.keep(guide_curves.session_uid, points)
    if before is not None:
        former_cache.keep(guide_curves.session_uid, before)
    return before is None or not np.array_equal(before, points)


def note_points(guide_curves, points):
    """Note (N, 3) points that were written to guides, so that they do not count as moved."""
    guide_cache.keep(guide_curves.session_uid, points)


def former_points_of(guide_curves):
    """Return (N, 3) local points of guides before they moved the last time, or None."""
    return former_cache.get(guide_curves.session_uid)


def points_of(guide_curves):
    """Return (N, 3) local points of guides, as last read by `have_guides_moved`."""
    return guide_cache.get(guide_curves.session_uid)


def has_mesh_moved(mesh):
    """Whether the positions of a mesh at rest have changed since the last call for it; True the first time."""
    positions = scene.vertex_positions(mesh)
    before = mesh_cache.get(mesh.session_uid)
    mesh_cache.keep(mesh.session_uid, positions)
    return before is None or not np.array_equal(before, positions)


def remember_places():
    """Store the transforms of all surfaces, after an update."""
    for datablock in bpy.data.hair_curves:
        if datablock.surface is not None and not surface_space.has_other_surface(datablock):
            place_cache.keep(datablock.session_uid, surface_space.to_world(datablock.surface))


def place_before(datablock):
    """Return the `Affine` of the surface of Curves at the last update, or None."""
    return place_cache.get(datablock.session_uid)
