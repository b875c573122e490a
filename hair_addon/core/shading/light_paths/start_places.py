# SPDX-License-Identifier: GPL-3.0-or-later
"""Where paths start: places that keep to their strands from frame to frame, and random numbers of paths from there.

A path is known by its segment and by its number there. All its random numbers follow
from these, and its directions are taken in the frame of what it meets. So while a camera or hair moves a little, the
same paths begin at the same places, and their light changes by as little.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from .grid_walk import PASSED, Medium, direction_of_hair, place_on, walk
from .strand_grid import StrandGrid

if TYPE_CHECKING:
    from .gather import Seen

wp.set_module_options({"enable_backward": False, "fast_math": True})

HIDDEN = wp.constant(3)  # kind of a place that is not in sight, beside what ends a path's way


@dataclass(frozen=True, eq=False)
class Starts:
    """N paths: where they start on strands, and in which direction light is wanted from there."""

    segments: np.ndarray  # (N,) int32 of a grid
    viewers: np.ndarray  # (N, 3) unit vectors towards the viewer
    reaches: np.ndarray  # (N,) float32 [m] towards the viewer that must be free; below zero: any direction
    keys: np.ndarray  # (N,) int32 of random numbers


@wp.struct
class StartsOnDevice:
    """`Starts` on a device."""

    segments: wp.array[int]
    viewers: wp.array[wp.vec3]
    reaches: wp.array[float]
    keys: wp.array[int]


@wp.func
def start(medium: Medium, starts: StartsOnDevice, path: int):
    """(`Met` where a path starts, `HIDDEN` where that is not in sight; direction there; random state)."""
    state = wp.rand_init(0, starts.keys[path])
    segment = starts.segments[path]
    direction = -starts.viewers[path]
    if starts.reaches[path] < 0.0:
        first = wp.randf(state)
        direction = direction_of_hair(medium, segment, first, wp.randf(state))
    part = wp.randf(state)
    met = place_on(medium, segment, part, 2.0 * wp.randf(state) - 1.0, direction)
    if starts.reaches[path] > 0.0:
        before = walk(medium, met.position, -direction, starts.reaches[path], medium.strands[segment])
        if before.kind != PASSED:
            met.kind = HIDDEN
    return met, direction, state


def of_seen(grid: StrandGrid, seen: "Seen", count: int, seed: int = 0) -> Starts:
    """`Starts` of about `count` paths on segments of a `gather.Seen`: on each as many as it is large in the picture.

    Which of them are in sight only rays can tell.
    """
    segments, first, which, counts = np.unique(
        seen.segments, return_index=True, return_inverse=True, return_counts=True
    )
    towards = np.stack([np.bincount(which, weights=axis) for axis in seen.directions.T], axis=-1)
    towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    start = grid.points[segments].astype(np.float64)
    along = grid.points[segments + 1].astype(np.float64) - start
    width = grid.radii[segments] + grid.radii[segments + 1]
    size = np.linalg.norm(np.cross(along, towards), axis=1) * width * counts / np.bincount(which, weights=seen.areas)
    wanted = size * (count / size.sum())
    reach = ((seen.positions[first] - start) * towards).sum(axis=1)
    each, number = _numbered(wanted, unit(hashed(segments, seed)))
    return Starts(
        segments[each].astype(np.int32),
        towards[each].astype(np.float32),
        np.maximum(reach[each], 0.0).astype(np.float32),
        hashed(segments[each], seed + 1, number).astype(np.int32),
    )


def anywhere(grid: StrandGrid, count: int, seed: int = 0) -> Starts:
    """`Starts` of about `count` paths on all strands of a grid, by their area, in any direction."""
    is_segment = grid.strands[:-1] == grid.strands[1:]
    along = np.diff(grid.points.astype(np.float64), axis=0)
    area = np.linalg.norm(along, axis=1) * (grid.radii[1:] + grid.radii[:-1]) * is_segment
    each, number = _numbered(area * (count / area.sum()), unit(hashed(np.arange(len(area)), seed + 2)))
    return Starts(
        each.astype(np.int32),
        np.zeros((len(each), 3), np.float32),
        np.full(len(each), -1.0, np.float32),
        hashed(each, seed + 3, number).astype(np.int32),
    )


def on_device(starts: Starts) -> StartsOnDevice:
    """`StartsOnDevice` of `Starts`."""
    found = StartsOnDevice()
    found.segments, found.keys = wp.array(starts.segments, dtype=int), wp.array(starts.keys, dtype=int)
    found.viewers, found.reaches = wp.array(starts.viewers, dtype=wp.vec3), wp.array(starts.reaches, dtype=float)
    return found


def _numbered(wanted, randoms):
    """(indices, numbers from 0 on) of things of which (N,) are wanted, rounded by random numbers of each."""
    numbers = np.floor(wanted + randoms).astype(int)
    each = np.repeat(np.arange(len(numbers)), numbers)
    return each, np.arange(len(each)) - np.repeat(np.cumsum(numbers) - numbers, numbers)


def hashed(values: np.ndarray, seed: int, number: np.ndarray | int = 0) -> np.ndarray:
    """(N,) uint32 of (N,) whole numbers, a seed and a second (N,) [Steele14, the finalizer of their generator]."""
    bits = np.asarray(values).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    bits = bits + np.asarray(number).astype(np.uint64) * np.uint64(0xD1B54A32D192ED03)
    bits = bits + np.uint64((seed * 0x8CB92BA72F3D8DD7) % 2**64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    return (bits ^ (bits >> np.uint64(31))).astype(np.uint32)


def unit(bits: np.ndarray) -> np.ndarray:
    """uint32 → [0, 1)."""
    return bits.astype(np.float64) / 2.0**32
