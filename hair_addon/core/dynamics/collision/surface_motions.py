# SPDX-License-Identifier: GPL-3.0-or-later
"""How colliders move in each substep of a frame, where kernels read it: nothing else of a substep is new to them."""

from typing import Any

import warp as wp

from .colliders import Colliders
from .nearest_surface import Motion

_SUBSTEPS = 32  # that there is room for from the beginning


class SurfaceMotions:
    """The `Motion` of each substep, written on the processor and read on the colliders' device."""

    def __init__(self, device: wp.DeviceLike) -> None:
        self._device = wp.get_device(device)
        self.make_room(_SUBSTEPS)

    def make_room(self, count: int) -> None:
        """Let there be as many substeps at least; what was noted before may be lost."""
        if hasattr(self, "array") and len(self.array) >= count:
            return
        self.array = wp.zeros(2 * count, dtype=Motion, device=self._device)  # for kernels
        written = self.array if self._device.is_cpu else wp.zeros(2 * count, dtype=Motion, device="cpu")
        self._rows = written.numpy()
        self._there, self._here = _bytes(self.array), _bytes(written)

    def note(self, substep: int, colliders: Colliders, grid: Any) -> None:
        """Write down how colliders come to where they are posed now, and where their `DistanceGrid` is, or None."""
        rows = self._rows
        (carry, carry_shift), (turned, moved) = colliders.carry, colliders.rigid_motion_so_far
        rows["motion"][substep], rows["deformation"][substep] = colliders.motion, colliders.deformation
        rows["carry"][substep], rows["carry_shift"][substep] = carry, carry_shift
        rows["to_rest"][substep], rows["moved"][substep] = turned.T, moved
        if grid is not None:
            places = rows["grid"]
            places["low"][substep], places["last"][substep] = grid.low, grid.last
            places["size"][substep], places["drift"][substep] = grid.size, grid.drift

    def send(self, first: int, end: int) -> None:
        """Bring what was noted of substeps first … end - 1 to the device."""
        if self._device.is_cpu:
            return
        size = self._rows.itemsize
        wp.copy(self._there, self._here, size * first, size * first, size * (end - first))


def _bytes(array):
    """The same memory."""
    count = len(array) * array.strides[0]
    return wp.array(ptr=array.ptr, dtype=wp.uint8, shape=(count,), device=array.device)
