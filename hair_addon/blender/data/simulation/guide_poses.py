# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses of guides on their surface in a frame, in meters and world axes, for simulation; and the way back to rest.

A guide moves rigidly with the surface at its root, like hair (posed_strands.py), and then with the object. The mean
scale of an unevenly scaled object is used.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ....core import dynamics
from ....core.errors import HairError
from ....core.geometry.affine import Affine
from ..strands import posed_strands, stored_roots
from ..strands.posed_strands import Pose


@dataclass(frozen=True)
class GuidePose:
    """A surface in one frame, and the roots of guides on it.

    places: root vertices and barycentric coordinates; matrix: (3, 4) float64, local coordinates → world [m];
    slides: (G, 3) offsets from first points to roots at rest, None if guides begin at their roots.
    """

    pose: Pose
    places: tuple[np.ndarray, np.ndarray]
    matrix: np.ndarray
    slides: np.ndarray | None = None

    @property
    def triangles(self) -> np.ndarray:
        """(F, 3) int32, wound so that normals point out of a closed mesh."""
        return self.pose.surface.mesh.triangles

    @cached_property
    def vertices(self) -> np.ndarray:
        """(V, 3) float64 [m]: the surface's vertices in the world."""
        return self._to_world(self.pose.surface.posed)

    @cached_property
    def _polar(self):
        return _polar(self.matrix[:, :3])

    @property
    def scale(self) -> float:
        """Meters per unit of local coordinates, averaged over the axes."""
        return float(abs(np.linalg.det(self.matrix[:, :3]))) ** (1.0 / 3.0)

    @cached_property
    def root_positions(self) -> np.ndarray:
        """(G, 3) float64 [m]: the guides' roots in the world."""
        vertices, barycentric = self.places
        return np.einsum("nc,ncx->nx", barycentric.astype(np.float64), self.vertices[vertices])

    def groom(self, local: np.ndarray) -> np.ndarray:
        """Points (G, P, 3) of combed guides in local coordinates → (G, P, 3) float64 [m] without rotation."""
        return local @ self._polar[1].T

    def root_pose(self, start: "GuidePose") -> "dynamics.root_motion.RootPose":
        """Return the current `RootPose` of a groom returned by `start.groom`; roots must be those of `start`."""
        vertices, barycentric = self.places
        roots = np.einsum("nc,ncx->nx", barycentric.astype(np.float64), self._rest[vertices])
        size = max(self.pose.surface.extent, 1e-20)
        crosses = roots[:, None] + size * np.concatenate([np.zeros((1, 3)), np.eye(3)])
        posed = self._carried(crosses.astype(np.float32)).astype(np.float64)
        axes = np.swapaxes(posed[:, 1:] - posed[:, :1], 1, 2) / size  # columns
        rotation = self._polar[0] @ _nearest_rotations(axes)
        turns = dynamics.rod.rotations.from_matrices(rotation)
        return dynamics.root_motion.RootPose(self._to_world(posed[:, 0]), turns, _rounded(self.scale / start.scale))

    def after(self, change: Affine) -> "GuidePose":
        """Return the pose that is the same in the world after an `Affine` was applied to the local coordinates.

        Only use its scale and the axes of its groom, which are in the new coordinates.
        """
        return replace(self, matrix=self.matrix @ change.inverse.matrix)

    def turn_to(self, other: "GuidePose") -> np.ndarray:
        """Return (4,) rotation x, y, z, w from the axes of `other.groom` to those of `self.groom`."""
        return dynamics.rod.rotations.from_matrices((self._polar[0].T @ other._polar[0])[None])[0]

    def to_rest(self, points: np.ndarray) -> np.ndarray:
        """Points (G, P, 3) [m] in the world → (G, P, 3) float32, local coordinates at rest."""
        local = (points - self.matrix[:, 3]) @ np.linalg.inv(self.matrix[:, :3]).T
        return self._slid(self._carried(local.astype(np.float32), is_back=True), -1.0)

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Return the inverse of `to_rest`, float64 [m]."""
        return self._to_world(self._carried(self._slid(np.ascontiguousarray(points, np.float32), 1.0)))

    def _slid(self, points, sign):
        return points if self.slides is None else points + np.float32(sign) * self.slides[:, None]

    @property
    def _rest(self):
        return self.pose.surface.rest.astype(np.float64)

    def _carried(self, points, is_back=False):
        if not self.pose.is_deformed:
            return points
        return posed_strands.carried(points, self.pose.motion_at(self.places[0]), self.places, is_back=is_back)

    def _to_world(self, points):
        return points @ self.matrix[:, :3].T + self.matrix[:, 3]


def _rounded(factor):
    """Return a factor rounded to 20 bits, so that rounding in the matrix of a rotating object does not change the
    scale.

    A change of scale would give guides a new rest shape in each frame.
    """
    mantissa, exponent = math.frexp(factor)
    return math.ldexp(round(math.ldexp(mantissa, 20)), exponent - 20)


def read(guides, depsgraph, meters):
    """Return the `GuidePose` of guide Curves in a depsgraph; meters: per unit of the world.

    Raises `HairError` if there is no surface or guides are not rooted on it.
    """
    surface_object = guides.surface
    if surface_object is None:
        raise HairError('"{name}" has no surface: attach the guides to a mesh.', name=guides.name)
    pose = posed_strands.read_pose(surface_object, depsgraph)
    if pose.surface is None:
        raise HairError('"{name}" is not a mesh: attach the guides to a mesh.', name=surface_object.name)
    places = stored_roots.places(guides, len(pose.surface.rest))
    if places is None or guides.vellus.topology != pose.surface.topology or not places[1].any(axis=1).all():
        raise HairError(
            'The guides "{name}" are not rooted on their current surface: comb or regenerate them.',
            name=guides.name,
        )
    matrix = np.array(surface_object.evaluated_get(depsgraph).matrix_world, np.float64)[:3]
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:, :3])) < 1e-30:
        raise HairError('"{name}" has a scale of zero: change its scale.', name=surface_object.name)
    return GuidePose(pose, places, meters * matrix, stored_roots.slides(guides))


def _polar(matrix):
    """Return (rotation R, P) with R P = matrix; R is proper, so that P mirrors if the matrix does."""
    left, sizes, right = np.linalg.svd(matrix)
    sign = np.sign(np.linalg.det(left @ right))
    return sign * (left @ right), sign * (right.T * sizes) @ right


def _nearest_rotations(matrices):
    left, _sizes, right = np.linalg.svd(matrices)
    return left @ right
