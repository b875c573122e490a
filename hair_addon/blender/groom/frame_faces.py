# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces whose faces differ between frames, for example by an animated modifier: this is not an edit.

Strands stay rooted on the faces of the frame in which they were generated. When the surface is reported later, as after
undo, faces that came with the frame are distinguished from edits by their number, recorded at each frame change.
"""

from collections.abc import Collection

import bpy
from bpy.types import Curves, Depsgraph, Object

from ..data import surface_space
from ..data.surfaces import Surface
from ..host import scene_time
from ..host.caches import Cache

# (session_uid of Curves, frame, topology of their roots) → (vertices, triangles) of their surface in that frame, if
# these numbers differ from those of the topology.
count_cache = Cache(capacity=4096)


def note(surfaces: Collection[Object], depsgraph: Depsgraph) -> None:
    """Record the numbers of faces of surfaces after a frame change."""
    for datablock in bpy.data.hair_curves if surfaces else ():
        surface, count = datablock.surface, surface_space.vertex_count_before(datablock)
        if surface not in surfaces or count is None:
            continue
        mesh = surface.evaluated_get(depsgraph).data
        if len(mesh.vertices) == count:
            count_cache.invalidate(_key(datablock))
        else:
            counts = len(mesh.vertices), len(mesh.loops) - 2 * len(mesh.polygons)
            count_cache.keep(_key(datablock), counts)


def differs_by_frame(datablock: Curves, surface: Surface) -> bool:
    """Whether a surface differs from the surface that Curves are rooted on because of the frame, not of an edit."""
    return count_cache.get(_key(datablock)) == (len(surface.rest), len(surface.mesh.triangles))


def are_others(datablock: Curves) -> bool:
    """Whether Curves, or the guides of hair, are rooted on the faces of another frame, as far as recorded."""
    known = (datablock, datablock.vellus.guide_curves)
    return any(one is not None and count_cache.get(_key(one)) is not None for one in known)


def _key(datablock):
    return datablock.session_uid, scene_time.present_frame(), datablock.vellus.topology
