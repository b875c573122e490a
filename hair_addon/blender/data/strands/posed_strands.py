# SPDX-License-Identifier: GPL-3.0-or-later
"""Posed strands: strands moved from the rest shape of their surface to its deformed shape, and back.

Used by viewports, exports, guides on edited surfaces and curves that become guides. Renders read evaluated Curves,
which the geometry nodes of follow_nodes.py move in the same way.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ....core import geometry
from ....core.geometry.mesh import require_finite
from .. import scene
from ..surfaces import Surface, cage_of


@dataclass(frozen=True)
class Pose:
    """The deformation of a surface at one time."""

    surface: Surface | None  # None for strands that are not on a mesh
    is_deformed: bool = False  # whether shape keys or modifiers have moved the surface from its rest shape

    @cached_property
    def _motions(self):
        """{id of a `VertexRotations`: (the `VertexRotations`, its `SurfaceMotion`)}."""
        return {}

    def motion_at(self, vertices):
        """Return the `SurfaceMotion` from the rest shape at some vertices, an array of indices; None at rest.

        Rotations of other vertices are missing, as many surfaces have fewer roots than vertices.
        """
        if not self.is_deformed:
            return None
        turning = self.surface.turning(vertices)
        if id(turning) not in self._motions:
            moved = geometry.surface_deform.turned(self.surface.rest, self.surface.posed, turning)
            self._motions[id(turning)] = turning, moved
        return self._motions[id(turning)][1]

    def carry(self, points, topology, places, chosen=slice(None), may_start_off_surface=False):
        """Return (M, P, 3) float32: the chosen strands on the deformed surface; unchanged if it is not deformed.

        points: (S, P, 3) float32 of all strands at rest, in local coordinates; topology: of the surface that they were
        rooted on; places: their roots from `Surface.places` or `stored_roots.places`, or None. Strands are rooted at
        the nearest point if the faces of the surface have changed or stored roots are damaged;
        may_start_off_surface: whether strands may begin off the surface.
        """
        if not self.is_deformed:
            return points[chosen]
        vertices, barycentric, *slides = self.rooted(topology, places, points[:, 0], may_start_off_surface)
        points = points[chosen] + slides[0][chosen][:, None] if slides else points[chosen]
        return carried(points, self.motion_at(vertices), (vertices[chosen], barycentric[chosen]))

    def carry_rooted(self, points, counts, places, chosen):
        """Return (N, 3) points of chosen strands with (M,) counts on the deformed surface; places: from `rooted`.

        Carries as `carry` does, for processing many strands in parts.
        """
        if not self.is_deformed:
            return points
        vertices, barycentric, *slides = places
        if slides:
            points = points + np.repeat(slides[0][chosen], counts, axis=0)
        return carried(points, self.motion_at(vertices), (vertices[chosen], barycentric[chosen]), counts)

    def rooted(self, topology, places, firsts, may_start_off_surface=False):
        """Roots on this surface for `carry_rooted`; firsts: (S, 3) local first points.

        A third array follows if strands were rooted on the cage or at another level of subdivision: (S, 3) offsets from
        first points to roots at rest. Faces at another level do not lie within the faces of a bent cage.
        """
        surface = self.surface
        if not self.is_deformed:
            return places
        if places is None or topology != surface.topology or len(places[0]) != len(firsts):
            places = np.zeros((len(firsts), 3), np.int32), np.zeros((len(firsts), 3), np.float32)
        vertices, barycentric, *slides = places
        lost = np.flatnonzero(~barycentric.any(axis=1) | (vertices >= len(surface.rest)).any(axis=1))
        if not len(lost):
            return places
        vertices, barycentric = vertices.copy(), barycentric.copy()
        vertices[lost], barycentric[lost] = surface.nearest_places(firsts[lost])
        if topology == surface.topology:
            for slide in slides:
                slide[lost] = 0.0
            return vertices, barycentric, *slides
        if may_start_off_surface or cage_of(topology) != cage_of(surface.topology):
            return vertices, barycentric
        at_rest = sum(barycentric[:, corner, None] * surface.rest[vertices[:, corner]] for corner in range(3))
        return vertices, barycentric, at_rest - firsts


def read_pose(surface_object, depsgraph, has_uvs=True):
    """Return the `Pose` of a surface in a depsgraph; at rest if it is None or not a mesh; has_uvs: as for
    `scene.read_surface`.
    """
    if surface_object is None or surface_object.type != "MESH":
        return Pose(None)
    return pose_of(scene.read_surface(surface_object, depsgraph, has_uvs))


def pose_of(surface):
    """Return the `Pose` of a `Surface`. Raises `HairError` if it is deformed and has non-finite vertices."""
    if surface.is_deformed:
        if not surface.has_finite_rest:
            require_finite(surface.rest)
        require_finite(surface.posed)
    return Pose(surface, surface.is_deformed)


def carried(points, motion, places, counts=None, is_back=False):
    """float32 points of strands, each moved rigidly with a `SurfaceMotion` at its root.

    points: (S, P, 3), or (N, 3) of strands with `counts` (S,) points; places: (S, 3) root vertices and barycentric
    coordinates; is_back: move by the inverse motion.
    """
    carry = geometry.surface_deform.carry
    if counts is None:
        return carry(points, motion, *places, is_back=is_back)
    if len(counts) and (counts == counts[0]).all():
        strands = points.reshape(len(counts), -1, 3)
        return carry(strands, motion, *places, is_back=is_back).reshape(-1, 3)
    of_points = (np.repeat(part, counts, axis=0) for part in places)  # each point as a strand of its own
    return carry(points[:, None], motion, *of_points, is_back=is_back)[:, 0]
