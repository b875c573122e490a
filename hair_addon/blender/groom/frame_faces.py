# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that have other faces in other frames, as a keyed modifier makes them: that is no edit.

Strands stay rooted on the faces of the frame that they were made in. Undo, redo and anything that reports the surface
find other faces there than strands know: those that came with the frame are told by their number, noted as it came.
"""

from collections.abc import Collection

import bpy
from bpy.types import Curves, Depsgraph, Object

from ..data import surface_space
from ..data.surfaces import Surface
from ..host import scene_time
from ..host.caches import Cache

# (session_uid of Curves, frame, the topology that they are rooted on) → (vertices, triangles) that their surface has
# there, where these are not as many as they are rooted on.
count_cache = Cache(capacity=4096)


def note(surfaces: Collection[Object], depsgraph: Depsgraph) -> None:
    """Note how many faces surfaces have in a frame that has just come."""
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


def came_with_the_frame(datablock: Curves, surface: Surface) -> bool:
    """Whether the faces of a surface, other than those that Curves are rooted on, are those of the present frame."""
    return count_cache.get(_key(datablock)) == (len(surface.rest), len(surface.mesh.triangles))


def are_others(datablock: Curves) -> bool:
    """Whether Curves, or the guides of hair, are rooted on the faces of another frame, as far as it was noted."""
    known = (datablock, datablock.vellus.guide_curves)
    return any(one is not None and count_cache.get(_key(one)) is not None for one in known)


def _key(datablock):
    return datablock.session_uid, scene_time.present_frame(), datablock.vellus.topology
