# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of every kind in groups of any size and order: styled and simulated.

Kernels process strands in groups, and branch if any strand of a group needs it. Inputs are derived from random numbers
by operations that are exact on all processors, so that results of several processors can be compared.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hair_addon.core.dynamics.rod import rod_solver
from hair_addon.core.styling import clump, curl, frizz, kinds, smooth, trim
from tests.support.devices import DEVICE
from tests.support.dynamics.rods import Simulation, in_lanes
from tests.support.dynamics.stepped import stepped

COUNT = 48
LARGEST = 33  # two groups of the widest vectors, and one strand more
POINTS, VERTICES = 41, 9

STYLES = {name: (offer.settings,) for name, offer in kinds.OFFERS.items() if name not in {"LEAN", "LIFT", "WET"}}
STYLES["TRIM"] = (trim.Settings(factor=0.6, random=0.2),)
STYLES["SCALED"] = (trim.Settings(factor=0.6, random=0.2, method="SCALE"),)
STYLES["TWO CLUMPS"] = (clump.Settings(size=0.04), curl.Settings(), clump.Settings(size=0.015, levels=1, seed=4))
STYLES["STACK"] = (clump.Settings(twist=1.0), curl.Settings(keep_length=0.5), frizz.Settings(seed=2), smooth.Settings())


def strands(rng: np.random.Generator, count: int = COUNT, point_count: int = POINTS) -> np.ndarray:
    """Return (S, P, 3) float32 [m]: some strands wind, some double back, some have coincident points."""
    heading = rng.uniform(-1.0, 1.0, (count, 1, 3)) + np.array([0.0, 0.0, 1.0])
    steps = heading + rng.uniform(0.0, 1.5, (count, 1, 1)) * rng.uniform(-1.0, 1.0, (count, point_count - 1, 3))
    steps *= 0.2 / point_count
    steps[::7, point_count // 2 :] *= -1.0
    steps[3::7, 2:4] = 0.0
    steps[5::7] = [0.0, 0.0, 0.2 / point_count]
    roots = rng.uniform(-0.02, 0.02, (count, 1, 3)) * [1.0, 1.0, 0.0]
    return np.concatenate([roots, roots + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)


@dataclass(frozen=True)
class Group:
    """Strands, and a function `of(order)` that computes results (M, …) for the strands order (M,)."""

    of: Callable[[np.ndarray], np.ndarray]
    count: int = COUNT

    def all(self) -> np.ndarray:
        """Return the results for all strands."""
        return self.of(np.arange(self.count))

    def different(self) -> Iterator[tuple[int, int]]:
        """Yield (group size, number of strands whose bits differ from those in the group of all strands)."""
        rng, wanted = np.random.default_rng(3), bits(self.all())
        for size in range(1, LARGEST + 1):
            order = rng.permutation(self.count)[:size]
            differs = bits(self.of(order)) != wanted[order]
            if differs.any():
                yield size, int(differs.reshape(size, -1).any(axis=1).sum())


def bits(values: np.ndarray) -> np.ndarray:
    """Return the bits of float32 values, so that -0 differs from 0, and NaN equals NaN."""
    return np.ascontiguousarray(values, np.float32).view(np.int32)


def styled(name: str, is_masked: bool = False) -> Group:
    """Return strands with `STYLES[name]`, in locks and without; a mask excludes some partly or completely."""
    rng = np.random.default_rng(4)  # some of these strands differed with implicit fused operations
    points, centres = strands(rng), strands(rng, 6)
    normals = np.float32([0.0, 0.0, 1.0]) + np.float32(rng.uniform(-0.3, 0.3, (COUNT, 3)))
    normals = (normals / np.sqrt((normals * normals).sum(axis=1, keepdims=True))).astype(np.float32)
    members = rng.integers(-1, len(centres), COUNT)
    weights = np.clip(rng.uniform(-0.3, 1.3, COUNT), 0.0, 1.0)
    styles = tuple(replace(settings, mask="mask") for settings in STYLES[name]) if is_masked else STYLES[name]
    return Group(
        lambda order: stepped(
            points[order],
            *styles,
            normals=normals[order],
            identities=order,
            weights=weights[order],
            members=members[order],
            centres=centres,
        )
    )


def all_groups() -> dict[str, Group]:
    """Return all groups by name."""
    found = {name: styled(name) for name in STYLES} | {f"{name}, masked": styled(name, True) for name in STYLES}
    return found | {"simulated": simulated()}


def simulated() -> Group:
    """Return positions and velocities of strands after three frames with moving roots, some against a plane."""
    groom = strands(np.random.default_rng(2), COUNT, VERTICES).astype(float)
    groom[3::7] = groom[5::7][0] - groom[5::7][0, :1] + groom[3::7, :1]  # segments of rods need a length
    planes = np.zeros((COUNT, VERTICES, rod_solver.PLANE_ROWS))
    planes[::2] = [0.0, 0.0, 1.0, -0.02, 0.0, 0.0, 0.0, 0.3]

    def of(order):
        simulation = Simulation(groom[order], substeps=3)
        around = rod_solver.Surroundings(planes=in_lanes(planes[order], DEVICE))
        for frame in range(3):
            simulation.roots = groom[order, 0] + 0.01 * frame * np.array([1.0, -0.5, 0.25])
            simulation.advance(surroundings=around)
        state = simulation.rods.save()
        return np.concatenate([state["positions"], state["velocities"], state["frames"]], axis=1)

    return Group(of)
