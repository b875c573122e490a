# SPDX-License-Identifier: GPL-3.0-or-later
"""Approximate Hessian of the energy, as a preconditioner: a network of springs between neighboring sites.

When two sites approach each other, the energy grows in proportion to the mass on both sides of their border; sideways
motion is free. The Hessian of the energy [Liu09] is therefore close to the Hessian of springs, with stiffnesses in
proportion to the shares of the two cells' masses. The mass of a cell without springs, along a border of the surface,
holds its site in place. Solving with this matrix spreads a change over many cells at once, whereas Lloyd's method
propagates the change from cell to cell; [Hateley15] use a graph Laplacian.
"""

import numpy as np
import warp as wp

from ..kernels import kernel_cache
from ..kernels.checks import require_count
from .lbfgs import dot
from .voronoi import Sites

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

NEAR, FAR = 1.2, 1.6  # springs fade out between these spacings; the second ring of a honeycomb is at 1.73
FEWEST_SPRINGS = 4.5  # cells with fewer springs are at a border
LEAST_HOLD = 0.02  # fraction of a cell's mass: prevents drift of a network without a border
YIELD = np.float32(1.3)  # measured optimum: unlike springs, cells yield sideways
ROUNDS = 3  # rounds of conjugate gradients: a preconditioner need not be exact


class Springs:
    """Springs between `Sites` whose cells have masses (n,) float64."""

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
        """Return the change of the gradient (n, 3) float32 for small moves (n, 3) of sites along the surface."""
        require_count("moves", len(moves), len(self._masses))
        moves = wp.array(moves, dtype=wp.vec3, device=self._device)
        inputs = [self._sites, self._stiffness, self._holds, moves]
        kernel_cache.launch(_pull, len(self._masses), inputs, [self._pull], device=self._device)
        return self._pull.numpy()

    def moves(self, gradient: np.ndarray) -> np.ndarray:
        """Return approximate moves (n, 3) float32 for a change of the gradient (n, 3), by conjugate gradients.

        [Hestenes52]
        """
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
    # Neighbourhood by the smaller spacing is symmetric.
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
            # Divided by the squared distance, so that `_pull` need not normalize directions.
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
