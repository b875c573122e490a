# SPDX-License-Identifier: GPL-3.0-or-later
"""Approximate Hessian of the energy, as a preconditioner: a network of springs between neighbouring sites.

When two sites approach each other, their border resists in proportion to the mass on both sides; sideways motion is
free. So the Hessian of the energy [Liu09] is close to that of springs, each as stiff as its part of the two cells'
masses; the mass of a cell without a spring, along a border of the surface, holds its site in place. Solving with it
spreads a change over many cells at once, where Lloyd's method propagates it from cell to cell; [Hateley15] use a graph
Laplacian.
"""

import numpy as np
import warp as wp

from ..kernels import kernel_cache
from ..kernels.checks import require_count
from .lbfgs import dot
from .voronoi import Sites

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

NEAR, FAR = 1.2, 1.6  # springs fade out between these spacings: the second ring of a honeycomb is at 1.73
FEWEST_SPRINGS = 4.5  # a cell with fewer is at a border
LEAST_HOLD = 0.02  # of a cell's mass: a network without a border could drift
YIELD = np.float32(1.3)  # measured best: cells give way sideways, springs do not
ROUNDS = 3  # of conjugate gradients: the preconditioner of a step need not be exact


class Springs:
    """The springs between `Sites` whose cells have masses (n,) float64."""

    def __init__(self, sites: Sites, masses: np.ndarray, device: wp.DeviceLike) -> None:
        require_count("masses", len(masses), len(sites.places))
        self._sites, self._device, self._masses = sites, device, masses
        self._stiffness = wp.empty(sites.around.shape, dtype=float, device=device)
        self._holds = wp.empty(len(masses), dtype=float, device=device)
        self._pull = wp.empty(len(masses), dtype=wp.vec3, device=device)
        shares = wp.empty(len(masses), dtype=float, device=device)
        on_device = wp.array(masses, dtype=float, device=device)
        inputs = [sites, on_device]
        kernel_cache.launch(_shares, len(masses), inputs, [shares], device=device)
        inputs += [shares]
        kernel_cache.launch(_stiffness, len(masses), inputs, [self._stiffness, self._holds], device=device)

    def pull(self, moves: np.ndarray) -> np.ndarray:
        """(n, 3) float32: how the gradient changes where sites make small moves (n, 3) along the surface."""
        require_count("moves", len(moves), len(self._masses))
        moves = wp.array(moves, dtype=wp.vec3, device=self._device)
        inputs = [self._sites, self._stiffness, self._holds, moves]
        kernel_cache.launch(_pull, len(self._masses), inputs, [self._pull], device=self._device)
        return self._pull.numpy()

    def moves(self, gradient: np.ndarray) -> np.ndarray:
        """(n, 3) float32: nearly the moves that change the gradient by (n, 3), by conjugate gradients [Hestenes52]."""
        filled = self._masses > 0.0
        inverse = np.where(filled, 0.5 / np.where(filled, self._masses, 1.0), 0.0).astype(np.float32)[:, None]
        rest = gradient.astype(np.float32)
        found = np.zeros_like(rest)
        towards = inverse * rest
        slope = dot(rest, towards)
        direction = towards
        for _ in range(ROUNDS):
            pull = self.pull(direction)
            bend = dot(direction, pull)
            if not bend > 0.0:
                break
            length = np.float32(slope / bend)
            found += length * direction
            rest = rest - length * pull
            towards = inverse * rest
            slope, before = dot(rest, towards), slope
            direction = towards + np.float32(slope / before) * direction
        return YIELD * found


@wp.func
def _nearness(sites: Sites, site: int, slot: int):
    other = sites.around[site, slot]
    if other == site or sites.islands[other] != sites.islands[site]:
        return 0.0
    # The smaller spacing: neighbours by it are mutual.
    apart = sites.apart[site, slot] / wp.min(sites.spacings[site], sites.spacings[other])
    fade = wp.clamp((FAR - apart) / (FAR - NEAR), 0.0, 1.0)
    facing = wp.clamp(wp.dot(sites.normals[site], sites.normals[other]), 0.0, 1.0)
    return fade * fade * (3.0 - 2.0 * fade) * facing


@wp.kernel
def _shares(
    sites: Sites,
    masses: wp.array[float],
    # outputs
    out_shares: wp.array[float],
):
    site = wp.tid()
    total = float(0.0)
    for slot in range(sites.counts[site]):
        total += _nearness(sites, site, slot)
    out_shares[site] = masses[site] / wp.max(total, FEWEST_SPRINGS)


@wp.kernel
def _stiffness(
    sites: Sites,
    masses: wp.array[float],
    shares: wp.array[float],
    # outputs
    out_stiffness: wp.array2d[float],
    out_holds: wp.array[float],
):
    site = wp.tid()
    total = float(0.0)
    for slot in range(sites.counts[site]):
        stiffness = float(0.0)
        nearness = _nearness(sites, site, slot)
        if nearness > 0.0:
            apart = sites.apart[site, slot]
            total += nearness * (shares[site] + shares[sites.around[site, slot]])
            # By the square of the distance, which spares `_pull` from making directions unit.
            stiffness = nearness * (shares[site] + shares[sites.around[site, slot]]) / wp.max(apart * apart, 1.0e-30)
        out_stiffness[site, slot] = stiffness
    out_holds[site] = wp.max(2.0 * masses[site] - total, LEAST_HOLD * masses[site])


@wp.kernel
def _pull(
    sites: Sites,
    stiffness: wp.array2d[float],
    holds: wp.array[float],
    moves: wp.array[wp.vec3],
    # outputs
    out_pull: wp.array[wp.vec3],
):
    site = wp.tid()
    place = sites.places[site]
    move = moves[site]
    pull = holds[site] * move
    for slot in range(sites.counts[site]):
        if stiffness[site, slot] > 0.0:
            other = sites.around[site, slot]
            towards = sites.places[other] - place
            pull += stiffness[site, slot] * wp.dot(towards, move - moves[other]) * towards
    normal = sites.normals[site]
    out_pull[site] = pull - wp.dot(pull, normal) * normal
