# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact planes between strands and colliders; the solver keeps points in front of these planes.

Arrays are (groups, rows, lanes), as in the solver. A vector has three rows. A plane has `PLANE` rows: the normal n (3),
the offset n·c + r with the surface point c and the distance r to keep, the displacement of the surface at c in this
substep (3), and the coefficient of friction. A point x is in front of a plane if n·x ≥ offset; n = 0 without contact.
"""

from typing import Any

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, parallel
from ...kernels.checks import require_count
from . import contact_queries
from .colliders import Colliders
from .contact_queries import PLANE, WIDTH, QueryOptions, Samples
from .distance_grid import distance_grid
from .nearest_surface import Surface
from .surface_motions import SurfaceMotions

RISE = 0.02  # largest outward speed of points that are inside a collider in the groom [m/s]
LEAST_ROWS = 128  # least number of blocks of `WIDTH` strands for a thread

_MOST_DRIFT = 0.5  # drift, in cells of the distance grid, beyond which the next frame builds a new grid
_DEEPEST = 0.1  # search radius for the groom's distances [m]


class Contacts:
    """Contact planes between `Colliders` and strands with positions (groups, vertices × 3, lanes) [m].

    Each vertex but the root keeps the smaller of the collider's distance and its distance in the groom, so that no
    vertex is pushed in the first frame. Raises `HairError` for arrays that do not match.
    """

    def __init__(self, groom: Any, colliders: Colliders) -> None:
        """groom: positions at rest [m], on the colliders' device; `colliders` must be in the pose of the groom."""
        if groom.ndim != 3 or groom.shape[1] % 3 or groom.shape[1] < 6 or groom.dtype != wp.float32:
            raise HairError("Positions of strands are (groups, vertices × 3, lanes) numbers of single precision.")
        self.colliders = colliders
        groups, rows, lanes = groom.shape
        if colliders.device.is_cpu and lanes % WIDTH:
            raise HairError("Strands come in groups of {width} lanes on a processor.", width=WIDTH)
        self._vertex_count = rows // 3
        self._shape = groups, rows, lanes
        device = colliders.device
        self.vertices, self.middles = (self._new_samples() for _ in range(2))
        self._planes: Any = None
        self._grid: Any = None
        self._distances = wp.empty(0, dtype=float, device=device)  # of the grid
        self._motions = SurfaceMotions(device)
        # Drift of the colliders before the frame in which the grid was built, and in this frame [m].
        self._grid_drift = self._first_drift = 0.0
        self._none = wp.empty((0, 0, 0), dtype=float, device=device)
        self._counts, self._read_count = (colliders.build_count, colliders.jump_count), colliders.read_count
        self.measure(groom)

    def measure(self, groom: Any) -> None:
        """Measure the distances between positions at rest and the colliders; points keep these distances."""
        self._require_shape(groom)
        self.forget()
        for is_middle, samples in enumerate((self.vertices, self.middles)):
            samples.rest.fill_(contact_queries.NOWHERE)
            samples.sides.zero_()
            if self.colliders.mesh is not None:
                self._launch(contact_queries.measure, [self.surface(), groom, is_middle, _DEEPEST], [samples])

    def find(
        self,
        positions: Any,
        last_positions: Any,
        duration: float,
        is_final: bool = False,
        moved: Any = None,
        is_skipping: bool = True,
    ) -> Any:
        """Return `planes` for the predicted positions of a substep, which began at `last_positions`.

        Call this in every substep, then again with `is_final`, because near surfaces are tracked between calls.
        duration: of the substep [s]; is_final: whether to return `found_planes`, for points that are still inside after
        the solve, without segments and without rise; moved: (groups, 1, lanes) numbers, non-zero for strands with
        points that have moved since, None to query all strands; is_skipping: False queries every point, with the same
        result.
        """
        self._require_shape(positions)
        self._require_shape(last_positions)
        if not is_final:
            self.follow()
        if self.colliders.mesh is None:
            planes = self.planes[int(is_final)]
            planes.zero_()
            return planes
        is_again = moved is not None
        if is_again:
            require_count("groups", moved.shape[0], self._shape[0])
            require_count("lanes", moved.shape[2], self._shape[2])
        self.note_motion()
        self.send_motions()
        asking = query_options(0.0 if is_final else duration, is_final, is_again, is_skipping)
        return self.look(self.surface(), asking, positions, last_positions, moved)

    def look(
        self, surface: Surface, asking: QueryOptions, positions: Any, last_positions: Any, moved: Any = None
    ) -> Any:
        """Launch the kernels of `find` for validated arrays, a surface and `QueryOptions`."""
        is_final = asking.is_final != 0
        *either, middle_planes = self.planes
        planes = either[int(is_final)]
        moved = self._none if moved is None else moved
        for is_middle in (0,) if is_final else (1, 0):
            inputs = [surface, asking, positions, last_positions, middle_planes, is_middle, moved]
            outputs = [self.middles if is_middle else self.vertices, middle_planes if is_middle else planes]
            self._launch(contact_queries.find_planes, inputs, outputs)
        return planes

    @property
    def planes(self) -> tuple[Any, Any, Any]:
        """Planes of all groups, from `planes_of`."""
        if self._planes is None:
            self._planes = self.planes_of(self._shape[0])
        return self._planes

    def follow(self) -> None:
        """Update the data of the colliders; call this once per substep, after the colliders are posed."""
        colliders = self.colliders
        counts = colliders.build_count, colliders.jump_count
        if self._counts != counts:
            self._counts = counts
            self.forget()
        if colliders.mesh is None:
            return
        is_new_frame, self._read_count = self._read_count != colliders.read_count, colliders.read_count
        drifted = colliders.drift_before - self._grid_drift
        if self._grid is None or (is_new_frame and drifted > _MOST_DRIFT * self._grid.size):
            self._grid, self._grid_drift, drifted = self._new_grid(), colliders.drift_before, 0.0
            self._first_drift = colliders.drift
            self._put_distances()
        self._grid.drift = self._first_drift + drifted + colliders.drift

    def _new_grid(self):
        """Return the grid of distances from the colliders' present pose, in rest coordinates."""
        turned, moved = self.colliders.rigid_motion_so_far
        mesh = self.colliders.mesh
        vertices = (mesh.points.numpy() - moved) @ turned
        groups, rows, lanes = self._shape
        sample_count = groups * rows // 3 * lanes
        return distance_grid(vertices, mesh.indices.numpy().reshape(-1, 3), sample_count, self.colliders.device)

    def _put_distances(self):
        """Copy the grid's distances to the kernels' array; an array that is too small is reallocated."""
        distances = self._grid.distances.flatten()
        if len(self._distances) < len(distances):
            count = len(distances) + len(distances) // 2
            self._distances = wp.empty(count, dtype=float, device=self.colliders.device)
        wp.copy(self._distances, distances, count=len(distances))

    def expect(self, count: int) -> None:
        """Prepare the colliders' motions for a frame with at most `count` substeps."""
        self.colliders.expect(count)
        self._motions.make_room(count)

    def note_motion(self, substep: int = 0) -> None:
        """Store the motion of the colliders to their present pose."""
        self._motions.note(substep, self.colliders, self._grid)

    def send_motions(self, first: int = 0, end: int = 1) -> None:
        """Send the stored motions of substeps first … end - 1 to the device."""
        self._motions.send(first, end)

    def memory(self) -> list[tuple[int, int]]:
        """Return the address and length of each array of `surface` that may be reallocated."""
        arrays = self._motions.array, self._distances, self.colliders.settings
        return [(array.ptr, len(array)) for array in arrays]

    def planes_of(self, group_count: int) -> tuple[Any, Any, Any]:
        """Return new planes for a number of groups: of vertices before and after the solve, and of segments."""
        counts = self._vertex_count, self._vertex_count, self._vertex_count - 1
        shapes = [(group_count, PLANE * count, self._shape[2]) for count in counts]
        first, second, third = (wp.zeros(shape, dtype=float, device=self.colliders.device) for shape in shapes)
        return first, second, third

    def forget(self) -> None:
        """Invalidate all tracked distances, after a change of colliders or positions."""
        self._grid = None
        for samples in (self.vertices, self.middles):
            samples.clear.zero_()

    def state(self) -> dict[str, np.ndarray]:
        """Return the state of contacts without positions, as arrays on the CPU."""
        state = {name: array.numpy().copy() for name, array in self._arrays()}
        return {name: np.minimum(array, 0.0) if "clear" in name else array for name, array in state.items()}

    def load(self, state: dict[str, np.ndarray]) -> None:
        """Restore a state. Raises `HairError` if its arrays do not match."""
        for name, target in self._arrays():
            array = state.get(name)
            if array is None or array.shape != target.shape or not np.isfinite(array).all():
                raise HairError("The state of contacts is not that of these strands.")
            target.assign(array)
        self._grid = None

    def _arrays(self):
        for name, samples in (("vertex", self.vertices), ("middle", self.middles)):
            yield from ((f"{name}_{what}", getattr(samples, what)) for what in ("rest", "sides", "clear"))

    def _new_samples(self):
        groups, _, lanes = self._shape
        shape, device, samples = (groups, self._vertex_count - 1, lanes), self.colliders.device, Samples()
        samples.rest, samples.clear = (wp.zeros(shape, dtype=float, device=device) for _ in range(2))
        samples.sides = wp.zeros(shape, dtype=int, device=device)
        samples.asked = wp.zeros((groups, 3 * shape[1], lanes), dtype=float, device=device)
        return samples

    def surface(self, substep: int = 0) -> Surface:
        """Return the colliders in their present pose for kernels; substep: index of its motion."""
        colliders, surface = self.colliders, Surface()
        surface.mesh, surface.points, surface.indices = colliders.mesh.id, colliders.mesh.points, colliders.mesh.indices
        surface.previous, surface.face_colliders = colliders.previous, colliders.face_colliders
        surface.rims, surface.settings = colliders.rims, colliders.settings
        surface.largest_distance, surface.motions, surface.substep = (
            colliders.largest_distance,
            self._motions.array,
            substep,
        )
        if self._grid is not None:
            surface.distances = self._distances
        return surface

    def _require_shape(self, positions):
        for name, count, wanted in zip(("groups", "rows", "lanes"), positions.shape, self._shape, strict=True):
            require_count(name, count, wanted)
        if not positions.is_contiguous or positions.device != self.colliders.device:
            raise HairError("Positions of strands must be one block of memory, on the colliders' device.")

    def _launch(self, kernel, inputs, outputs):
        """Launch a kernel for all samples; a CPU divides blocks of `WIDTH` strands between all cores."""
        groups, _, lanes = self._shape
        device, count = self.colliders.device, self._vertex_count - 1
        at_once = (count, WIDTH) if device.is_cpu else (1, 1)
        thread_count = groups * count * lanes // (at_once[0] * at_once[1])
        if not device.is_cpu:
            first, block = 0, contact_queries.BLOCK
            kernel_cache.launch(kernel, thread_count, [*inputs, *at_once, first], outputs, device, block)
            return
        kernel_cache.load(device, kernel.module)
        shares = parallel.share_count(thread_count, device, LEAST_ROWS)
        parallel.launch_shares(kernel, thread_count, [*inputs, *at_once], [outputs] * shares, device)


def query_options(
    duration: float, is_final: bool = False, is_again: bool = False, is_skipping: bool = True
) -> QueryOptions:
    """Return the `QueryOptions` of a substep; duration: [s], 0 for no rise; other arguments as in `Contacts.find`."""
    asking = QueryOptions()
    asking.is_final, asking.is_again, asking.is_skipping = int(is_final), int(is_again), int(is_skipping)
    asking.rise = RISE * duration
    return asking
