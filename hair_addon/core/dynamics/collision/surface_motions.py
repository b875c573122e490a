# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of colliders in each substep of a frame, for kernels: the only data that changes between substeps."""

from typing import Any

import warp as wp

from .colliders import Colliders
from .nearest_surface import Motion

_SUBSTEPS = 32  # initial capacity


class SurfaceMotions:
    """The `Motion` of each substep, written on the CPU and read on the colliders' device."""

    def __init__(self, device: wp.DeviceLike) -> None:
        self._device = wp.get_device(device)
        self.make_room(_SUBSTEPS)

    def make_room(self, count: int) -> None:
        """Ensure capacity for a number of substeps; stored motions may be lost."""
        if hasattr(self, "array") and len(self.array) >= count:
            return
        self.array = wp.zeros(2 * count, dtype=Motion, device=self._device)  # for kernels
        written = self.array if self._device.is_cpu else wp.zeros(2 * count, dtype=Motion, device="cpu")
        self._rows = written.numpy()
        self._target, self._source = _bytes(self.array), _bytes(written)

    def note(self, substep: int, colliders: Colliders, grid: Any) -> None:
        """Store the motion of colliders to their present pose, and the place of their `DistanceGrid`, if any."""
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
        """Copy the motions of substeps first … end - 1 to the device."""
        if self._device.is_cpu:
            return
        size = self._rows.itemsize
        wp.copy(self._target, self._source, size * first, size * first, size * (end - first))


def _bytes(array):
    """Return the memory of an array as bytes."""
    count = len(array) * array.strides[0]
    return wp.array(ptr=array.ptr, dtype=wp.uint8, shape=(count,), device=array.device)
