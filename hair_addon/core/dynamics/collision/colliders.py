# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that hair collides with, combined into one `wp.Mesh`, interpolated between the poses of two frames.

Input is validated before it is passed to Warp: a mesh without faces, an index out of range or a non-finite coordinate
would crash Blender, or make all queries fail.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ...errors import HairError
from ...geometry.mesh import TriMesh
from ...kernels import parallel
from ...kernels.parallel import Rows
from .closed_parts import outward, rims
from .rigid_motion import STILL, RigidMotion, largest

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

FARTHEST = 1.0e6  # largest absolute coordinate of a vertex [m]

_LEAST_ROWS = 32_768  # least number of vertices for a thread


@dataclass(frozen=True)
class Collider:
    """A mesh in its pose at the end of a frame; name: unique among colliders.

    friction: Coulomb's coefficient; distance: between hair and the mesh [m]; is_double_sided: True for sheets, on which
    each point of hair stays on its side; False if the back of the mesh is its inside.
    """

    name: str
    mesh: TriMesh
    friction: float = 0.3
    distance: float = 1e-3
    is_double_sided: bool = False


@dataclass
class _Known:
    """An active collider, with its triangles in Warp's mesh."""

    mesh: TriMesh  # with the vertices of the last frame
    triangles: np.ndarray  # of positive area, wound outwards
    rims: np.ndarray


@dataclass(frozen=True)
class _Move:
    """Motion of the colliders between two times in a frame; names as in `Colliders`."""

    rigid_motion: tuple[np.ndarray, np.ndarray]
    motion: float
    carry: tuple[np.ndarray, np.ndarray]
    deformation: float
    drift: float


class Colliders:
    """Colliders on a device; call `read` once per frame, then `pose` once per substep.

    Triangles of zero area in the first frame of a collider are ignored.
    """

    def __init__(self, device: wp.DeviceLike = "cpu") -> None:
        self.device = wp.get_device(device)
        self.notes: list[HairError] = []  # ignored or stopped colliders of the last frame
        self.build_count = 0  # number of meshes built
        self.read_count = 0  # number of frames
        self.jump_count = 0  # number of frames that did not start in the pose of the previous one
        self.mesh: Any = None  # wp.Mesh in its present pose; None without colliders
        self.previous: Any = None  # (V,) vec3: pose of the previous substep
        self.face_colliders: Any = None  # (F,) int
        self.rims: Any = None  # (F,) int, from `closed_parts.rims`
        self.settings: Any = None  # (C,) vec3: friction, distance [m], 1 if double-sided
        self._rows: list[tuple[float, float, float]] = []  # rows of `settings`
        self.names: tuple[str, ...] = ()
        self.largest_distance = 0.0  # [m]
        self.largest_motion = 0.0  # largest motion of a vertex in this frame [m]
        # Rigid motion (rotation (3, 3), translation [m]) of all colliders in this substep, and since the beginning;
        # `motion`: bound of the residual motion of a vertex in this substep [m].
        self.rigid_motion = self.rigid_motion_so_far = STILL
        self.motion = 0.0
        # Affine motion (matrix (3, 3), translation [m]) of points with the colliders, and bound of the residual [m].
        self.carry, self.deformation = STILL, 0.0
        # Bound of the residual motion of a vertex in this frame, and in all previous frames [m].
        self.drift = self.drift_before = 0.0
        self._known: dict[str, _Known] = {}
        self._before: Any = None
        self._after: Any = None
        self._way: Any = None  # RigidMotion of the frame
        self._end: Any = None  # vertices (V, 3) at the end of the frame
        self._part = 0.0
        self._is_still = True
        self._posed: Any = None  # vertices of the mesh; None between two frames
        self._moves: dict[tuple[float, float], _Move] = {}  # moves in this frame, by start and end

    def read(self, colliders: Sequence[Collider], frame: int = 0) -> None:
        """Set the poses at the end of a frame, which starts at the end of the previous one.

        A new collider is at rest in its first frame. Invalid colliders are ignored; colliders with changed topology
        keep their previous pose. Both are reported in `notes`, with the frame.
        """
        self.notes = []
        self.read_count += 1
        taken, known = [], {}
        for collider in colliders:
            is_new = collider.name not in self._known
            problem = problem_of(collider, frame, is_new) or (collider.name in known and _repeated(collider, frame))
            if problem:
                self.notes.append(problem)
                continue
            known[collider.name], before, after = self._taken(collider, frame)
            taken.append((collider, before, after))
        is_same = list(known) == list(self._known) and all(known[name] is self._known[name] for name in known)
        self._known = known
        if not is_same or (self.mesh is None and known):
            self._build()
        self._put([before for _, before, _ in taken], [after for _, _, after in taken])
        self._set([collider for collider, _, _ in taken])

    @property
    def is_still(self) -> bool:
        """Whether there are colliders and none of them moves in this frame."""
        return self.mesh is not None and self._is_still

    def pose(self, part: float) -> None:
        """Move to the linearly interpolated pose at a fraction in [0, 1] of the frame; fractions must increase."""
        self.go_to(part)
        self.place(part)

    def expect(self, count: int) -> None:
        """Compute the motions to a number of equidistant poses of the frame in advance."""
        if self.mesh is None or self._is_still or (0.0, 1.0 / count) in self._moves:
            return
        parts = [step / count for step in range(count + 1)]
        self._moves.update(zip(itertools.pairwise(parts), self._moves_of(parts[:-1], parts[1:]), strict=True))

    def go_to(self, part: float) -> None:
        """Update the motion data on the host for a pose: the first half of `pose`."""
        if self.mesh is None or self._is_still:
            return
        key = self._part, part
        move = self._moves[key] if key in self._moves else self._moves_of([self._part], [part])[0]
        self.rigid_motion, self.motion = move.rigid_motion, move.motion
        self.carry, self.deformation = move.carry, move.deformation
        (turn, shift), (turned, moved) = self.rigid_motion, self.rigid_motion_so_far
        self.rigid_motion_so_far = turn @ turned, turn @ moved + shift
        self.drift = move.drift
        self._part, self._posed = part, self._end if part == 1.0 else None

    def _moves_of(self, first, last):
        """Return the `_Move` of each substep, from start and end times."""
        (turns, shifts), motions = self._way.between(first, last)
        (carries, carry_shifts), deformations = self._way.carried(first, last)
        drifts = self._way.between(np.zeros(len(last)), last)[1]
        whole = zip(turns, shifts, strict=True), motions.tolist(), zip(carries, carry_shifts, strict=True)
        return [_Move(*row) for row in zip(*whole, deformations.tolist(), drifts.tolist(), strict=True)]

    def place(self, part: float) -> None:
        """Move the mesh on the device to a pose: the second half of `pose`."""
        if self.mesh is None or self._is_still:
            return
        parallel.launch(
            _interpolate,
            len(self._before),
            inputs=[Rows(self._before), Rows(self._after), float(part)],
            outputs=[self.previous, self.mesh.points],
            device=self.device,
            least_rows=_LEAST_ROWS,
        )
        self.mesh.refit()

    def _taken(self, collider, frame):
        """Return the `_Known` of a collider, and its vertices at the beginning and at the end of the frame."""
        known, mesh = self._known.get(collider.name), collider.mesh
        if known is None:
            known = _first_known(mesh)
            return known, mesh.vertices, mesh.vertices
        before = known.mesh
        if len(mesh.vertices) == len(before.vertices) and np.array_equal(mesh.triangles, before.triangles):
            known.mesh = TriMesh(mesh.vertices, before.triangles)
            return known, before.vertices, mesh.vertices
        self.notes.append(
            HairError(
                "{name} changes its vertices or faces in frame {frame}: hair collides with its previous shape.",
                name=collider.name,
                frame=frame,
            )
        )
        return known, before.vertices, before.vertices

    def _build(self):
        """Build the mesh of all colliders; `_put` writes its vertices."""
        self.build_count += 1
        self.names = tuple(self._known)
        if not self._known:
            self.mesh = self.previous = self.face_colliders = self.rims = None
            return
        known = list(self._known.values())
        firsts = np.cumsum([0, *(len(one.mesh.vertices) for one in known)])
        triangles = np.concatenate([one.triangles + first for one, first in zip(known, firsts[:-1], strict=True)])
        vertices = np.concatenate([one.mesh.vertices for one in known])
        owners = np.repeat(np.arange(len(known), dtype=np.int32), [len(one.triangles) for one in known])
        points = wp.array(vertices, dtype=wp.vec3, device=self.device)
        self.previous, self._before, self._after = (wp.clone(points) for _ in range(3))
        indices = wp.array(triangles.astype(np.int32).ravel(), dtype=int, device=self.device)
        self.mesh = wp.Mesh(points=points, indices=indices)
        self._posed = None
        self.face_colliders = wp.array(owners, dtype=int, device=self.device)
        self.rims = wp.array(np.concatenate([one.rims for one in known]), dtype=int, device=self.device)

    def _put(self, before, after):
        """Write the vertices at the beginning and at the end of the frame, and pose the mesh at its beginning."""
        self._part, self.motion, self.deformation, self.largest_motion = 0.0, 0.0, 0.0, 0.0
        self.rigid_motion = self.carry = STILL
        self.drift_before, self.drift = self.drift_before + self.drift, 0.0
        self._is_still = True
        self._moves.clear()
        if self.mesh is None:
            return
        before, after = np.concatenate(before), np.concatenate(after)
        if self._posed is None or not np.array_equal(self._posed, before):
            self.mesh.points.assign(before)
            self.mesh.refit()
            self._posed = before
            self.jump_count += 1
        wp.copy(self.previous, self.mesh.points)
        self._is_still = np.array_equal(before, after)
        if self._is_still:
            return
        self._way, self._end = RigidMotion(before, after), after
        self.largest_motion = largest(after - before)
        wp.copy(self._before, self.mesh.points)
        self._after.assign(after)

    def _set(self, colliders):
        rows = [(one.friction, one.distance, float(one.is_double_sided)) for one in colliders]
        if rows != self._rows:  # otherwise the array keeps its address
            self._rows = rows
            self.settings = wp.array(np.array(rows, np.float32).reshape(-1, 3), dtype=wp.vec3, device=self.device)
        self.largest_distance = max((one.distance for one in colliders), default=0.0)


def problem_of(collider: Collider, frame: int = 0, is_new: bool = True) -> HairError | None:
    """Return the reason why a collider is unusable, with its name and the frame; None if it is usable.

    is_new: False skips the slow check for faces of positive area; known colliders have passed this check.
    """
    cause = _cause(collider, is_new)
    if cause is None:
        return None
    return HairError(
        "{name} does not collide with hair in frame {frame}: {cause}.", name=collider.name, frame=frame, cause=cause
    )


def _cause(collider, is_new):
    mesh = collider.mesh
    vertices, triangles = mesh.vertices, mesh.triangles
    if vertices.ndim != 2 or vertices.shape[1] != 3 or vertices.dtype != np.float32:
        return "its vertices are not an array of positions"
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype != np.int32:
        return "its faces are not an array of triangles"
    if not len(triangles):
        return "it has no faces"
    try:
        _ = mesh.checked_triangles
    except HairError:
        return "a face uses a vertex that is missing"
    if not np.isfinite(vertices).all():
        return "it has vertices with non-finite coordinates"
    if np.abs(vertices).max() > FARTHEST:
        return f"it extends more than {FARTHEST / 1000:g} km from the origin"
    if (vertices == vertices[0]).all() or (is_new and not (mesh.areas > 0.0).any()):
        return "its faces have no area"
    for name, value, most in (("friction", collider.friction, 100.0), ("distance", collider.distance, 10.0)):
        if not (math.isfinite(value) and 0.0 <= value <= most):
            return f"its {name} is not between 0 and {most:g}"
    return None


def _repeated(collider, frame):
    return HairError("Two colliders are named {name} in frame {frame}.", name=collider.name, frame=frame)


def _first_known(mesh):
    with_area = np.flatnonzero(mesh.areas > 0.0)
    used = TriMesh(mesh.vertices, mesh.triangles[with_area])
    return _Known(mesh, outward(used), rims(used))


@wp.kernel
def _interpolate(
    before: wp.array[wp.vec3],
    after: wp.array[wp.vec3],
    part: float,
    # outputs
    out_previous: wp.array[wp.vec3],
    out_points: wp.array[wp.vec3],
):
    vertex = wp.tid()
    out_previous[vertex] = out_points[vertex]
    out_points[vertex] = (1.0 - part) * before[vertex] + part * after[vertex]
