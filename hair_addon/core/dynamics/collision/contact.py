# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes of contact between strands and colliders, for the solver to keep points in front of.

Arrays are in lane groups: (groups, rows, lanes), as the solver's. A vector takes three rows, a plane `PLANE` rows:
n (3), the offset n·c + r, the displacement of the surface at c in this substep (3), and the coefficient of friction.
A point in front has n·x ≥ offset; n = 0 where there is no contact.
"""

from typing import Any

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, parallel
from ...kernels.checks import require_count
from . import contact_queries
from .colliders import Colliders
from .contact_queries import PLANE, WIDTH, Asking, Samples
from .distance_grid import distance_grid
from .nearest_surface import Surface
from .surface_motions import SurfaceMotions

RISE = 0.02  # [m/s] at most, of a point that the groom has inside
LEAST_ROWS = 128  # times `WIDTH` strands that are worth a thread

_MOST_DRIFT = 0.5  # of a cell of the grid of distances, after which the next frame has a new one
_DEEPEST = 0.1  # [m] inside that the groom is measured


class Contacts:
    """Planes of contact of strands, (groups, vertices × 3, lanes) positions [m], with `Colliders`.

    Each vertex but the root keeps min(the collider's distance, its own in the groom), so that nothing is pushed in the
    first frame. Raises `HairError` for arrays that do not fit.
    """

    def __init__(self, groom: Any, colliders: Colliders) -> None:
        """groom: positions at rest [m], on the colliders' device, to which `colliders` is posed."""
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
        # How far colliders had drifted before the frame in which the grid was made, and in that frame [m].
        self._grid_drift = self._first_drift = 0.0
        self._none = wp.empty((0, 0, 0), dtype=float, device=device)
        self._counts, self._read_count = (colliders.build_count, colliders.jump_count), colliders.read_count
        self.measure(groom)

    def measure(self, groom: Any) -> None:
        """Take other positions at rest: distances that points keep follow from them."""
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

        Called in every substep, then once more with `is_final`: what is near is followed from one to the next.
        duration [s] of the substep. is_final: afterwards, for points that are still inside, `found_planes`: segments
        are not asked, and nothing rises; moved: (groups, 1, lanes) numbers, not zero for strands some of whose points
        have moved since: only these ask again. is_skipping: off asks the surface for every point, which finds the same.
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
        asking = asking_of(0.0 if is_final else duration, is_final, is_again, is_skipping)
        return self.look(self.surface(), asking, positions, last_positions, moved)

    def look(self, surface: Surface, asking: Asking, positions: Any, last_positions: Any, moved: Any = None) -> Any:
        """The launches of `find`, of arrays that it has checked: for a surface and a way of asking."""
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
        """Planes of all groups, as `planes_of`."""
        if self._planes is None:
            self._planes = self.planes_of(self._shape[0])
        return self._planes

    def follow(self) -> None:
        """Keep what is known of the colliders true; once in a substep, after they were posed."""
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
        """The colliders' distances where they are, seen from where they were at rest."""
        turned, moved = self.colliders.rigid_motion_so_far
        mesh = self.colliders.mesh
        vertices = (mesh.points.numpy() - moved) @ turned
        groups, rows, lanes = self._shape
        sample_count = groups * rows // 3 * lanes
        return distance_grid(vertices, mesh.indices.numpy().reshape(-1, 3), sample_count, self.colliders.device)

    def _put_distances(self):
        """Copy the grid's distances to where kernels read them: the same memory for as long as they fit."""
        distances = self._grid.distances.flatten()
        if len(self._distances) < len(distances):
            count = len(distances) + len(distances) // 2
            self._distances = wp.empty(count, dtype=float, device=self.colliders.device)
        wp.copy(self._distances, distances, count=len(distances))

    def expect(self, count: int) -> None:
        """Say how many substeps the frame has, at most."""
        self.colliders.expect(count)
        self._motions.make_room(count)

    def note_motion(self, substep: int = 0) -> None:
        """Write down how the colliders come to where they are posed now."""
        self._motions.note(substep, self.colliders, self._grid)

    def send_motions(self, first: int = 0, end: int = 1) -> None:
        """Let kernels read what was noted of substeps first … end - 1."""
        self._motions.send(first, end)

    def memory(self) -> list[tuple[int, int]]:
        """Address and length of the arrays of `surface` that may become others."""
        arrays = self._motions.array, self._distances, self.colliders.settings
        return [(array.ptr, len(array)) for array in arrays]

    def planes_of(self, group_count: int) -> tuple[Any, Any, Any]:
        """Memory for planes of some groups: of vertices before and after the solve, and of segments."""
        counts = self._vertex_count, self._vertex_count, self._vertex_count - 1
        shapes = [(group_count, PLANE * count, self._shape[2]) for count in counts]
        first, second, third = (wp.zeros(shape, dtype=float, device=self.colliders.device) for shape in shapes)
        return first, second, third

    def forget(self) -> None:
        """Let every point ask the surface again: colliders or positions are others."""
        self._grid = None
        for samples in (self.vertices, self.middles):
            samples.clear.zero_()

    def state(self) -> dict[str, np.ndarray]:
        """What later planes follow from, beside positions: as arrays on the processor."""
        state = {name: array.numpy().copy() for name, array in self._arrays()}
        return {name: np.minimum(array, 0.0) if "clear" in name else array for name, array in state.items()}

    def load(self, state: dict[str, np.ndarray]) -> None:
        """Take a state of such strands. Raises `HairError` where its arrays do not fit."""
        for name, there in self._arrays():
            array = state.get(name)
            if array is None or array.shape != there.shape or not np.isfinite(array).all():
                raise HairError("The state of contacts is not that of these strands.")
            there.assign(array)
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
        """The colliders in their present pose, for kernels; substep: whose motion they read."""
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
        """Launch a kernel for all samples: on a processor a thread for `WIDTH` strands each, on all cores."""
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


def asking_of(duration: float, is_final: bool = False, is_again: bool = False, is_skipping: bool = True) -> Asking:
    """How samples ask in a substep of a duration [s], zero where nothing rises; the rest as in `Contacts.find`."""
    asking = Asking()
    asking.is_final, asking.is_again, asking.is_skipping = int(is_final), int(is_again), int(is_skipping)
    asking.rise = RISE * duration
    return asking
