# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes of contact between strands and colliders, for the solver to keep points in front of.

Arrays are in lane groups: (groups, rows, lanes), as the solver's. A vector takes three rows, a plane `PLANE` rows:
n (3), the offset n·c + r, the displacement of the surface at c in this substep (3), and the coefficient of friction.
A point in front has n·x ≥ offset; n = 0 where there is no contact.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import kernel_cache, parallel
from ..kernels.checks import require_count
from . import contact_queries
from .colliders import Colliders
from .contact_queries import PLANE, WIDTH
from .nearest_surface import Surface

RISE = 0.02  # [m/s] at most, of a point that the groom has inside
LEAST_ROWS = 128  # times `WIDTH` strands that are worth a thread

_DEEPEST = 0.1  # [m] inside that the groom is measured


@dataclass
class Samples:
    """Points of strands that ask for a plane, (groups, samples, lanes), and what they keep from substep to substep."""

    rest: Any  # float [m]: the distance in the groom, negative inside, `NOWHERE` where no collider is near
    sides: Any  # int: ± (1 + collider) of the double-sided one nearby, 0: none
    asked: Any  # (groups, 3 samples, lanes) float [m]: where it last looked for a surface, `Surface.to_rest`
    clear: Any  # float [m]: how far from there it was at least, less its motion since; negative for a point inside


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
        self._vertices, self._middles = (self._new_samples() for _ in range(2))
        shape = groups, PLANE * self._vertex_count, lanes
        self.planes, self.found_planes = (wp.zeros(shape, dtype=float, device=device) for _ in range(2))
        self._middle_planes = wp.zeros((groups, PLANE * (self._vertex_count - 1), lanes), dtype=float, device=device)
        self._none = wp.empty((0, 0, 0), dtype=float, device=device)
        self._build_count = colliders.build_count
        self.measure(groom)

    def measure(self, groom: Any) -> None:
        """Take other positions at rest: distances that points keep follow from them."""
        self._require_shape(groom)
        self.forget()
        for is_middle, samples in enumerate((self._vertices, self._middles)):
            samples.rest.fill_(contact_queries.NOWHERE)
            samples.sides.zero_()
            if self.colliders.mesh is not None:
                self._launch(
                    contact_queries.measure,
                    [self._surface(), groom],
                    [is_middle, _DEEPEST],
                    [samples.rest, samples.sides],
                )

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
        if self._build_count != self.colliders.build_count:
            self._build_count = self.colliders.build_count
            self.forget()
        planes = self.found_planes if is_final else self.planes
        if self.colliders.mesh is None:
            planes.zero_()
            return planes
        is_again = moved is not None
        if is_again:
            require_count("groups", moved.shape[0], self._shape[0])
            require_count("lanes", moved.shape[2], self._shape[2])
        surface, rise = self._surface(), 0.0 if is_final else RISE * duration
        for is_middle in (0,) if is_final else (1, 0):
            samples = self._middles if is_middle else self._vertices
            kept = [samples.rest, samples.sides, samples.asked, samples.clear]
            self._launch(
                contact_queries.find_planes,
                [surface, positions, last_positions, self._middle_planes],
                [is_middle, rise, int(is_final), int(is_again), int(is_skipping), moved if is_again else self._none],
                [*kept, self._middle_planes if is_middle else planes],
            )
        return planes

    def forget(self) -> None:
        """Let every point ask the surface again: colliders or positions are others."""
        for samples in (self._vertices, self._middles):
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

    def _arrays(self):
        for name, samples in (("vertex", self._vertices), ("middle", self._middles)):
            yield from ((f"{name}_{what}", getattr(samples, what)) for what in ("rest", "sides", "clear"))

    def _new_samples(self):
        groups, _, lanes = self._shape
        shape, device = (groups, self._vertex_count - 1, lanes), self.colliders.device
        numbers = [wp.zeros(shape, dtype=float, device=device) for _ in range(2)]
        asked = wp.zeros((groups, 3 * shape[1], lanes), dtype=float, device=device)
        return Samples(numbers[0], wp.zeros(shape, dtype=int, device=device), asked, numbers[1])

    def _surface(self):
        colliders, surface = self.colliders, Surface()
        surface.mesh, surface.points, surface.indices = colliders.mesh.id, colliders.mesh.points, colliders.mesh.indices
        surface.previous, surface.face_colliders = colliders.previous, colliders.face_colliders
        surface.rims, surface.settings = colliders.rims, colliders.settings
        surface.largest_distance, surface.motion = colliders.largest_distance, colliders.motion
        turned, moved = colliders.rigid_motion_so_far
        (carry, carry_shift), surface.deformation = colliders.carry, colliders.deformation
        surface.carry, surface.carry_shift = wp.mat33(carry), wp.vec3(carry_shift)
        surface.to_rest, surface.moved = wp.mat33(turned.T), wp.vec3(moved)
        return surface

    def _require_shape(self, positions):
        for name, count, wanted in zip(("groups", "rows", "lanes"), positions.shape, self._shape, strict=True):
            require_count(name, count, wanted)
        if not positions.is_contiguous or positions.device != self.colliders.device:
            raise HairError("Positions of strands must be one block of memory, on the colliders' device.")

    def _launch(self, kernel, arrays, details, outputs):
        """Launch a kernel for all samples: on a processor a thread for `WIDTH` strands each, on all cores."""
        groups, _, lanes = self._shape
        device, count = self.colliders.device, self._vertex_count - 1
        at_once = (count, WIDTH) if device.is_cpu else (1, 1)
        thread_count = groups * count * lanes // (at_once[0] * at_once[1])
        kernel_cache.load(device, kernel.module)
        shares = parallel.share_count(thread_count, device, LEAST_ROWS)
        parallel.launch_shares(kernel, thread_count, [*arrays, count, *at_once, *details], [outputs] * shares, device)
