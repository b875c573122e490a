# SPDX-License-Identifier: GPL-3.0-or-later
"""Centroidal Voronoi tessellation of a surface, for guide roots  [Du99], [Report12] section 2.3.

The cell V_i of a site s_i is the part of the surface that is nearer to s_i than to any other site (voronoi.py). With a
density rho, the energy is E = sum_i ∫_{V_i} rho(x) |x - s_i|² dA, and its gradient 2 m_i (s_i - c_i), with the centroid
c_i and the mass m_i of the cell. Lloyd's step, to the surface point nearest to the centroid, never raises E. L-BFGS
[Liu09] starts with the Hessian of springs between neighbors (preconditioner.py) and refines it; if a step raises E,
Lloyd's step is taken instead and L-BFGS restarts.

From a random start any descent ends in mismatched honeycomb grains. Therefore a few distant sites (farthest.py) are
relaxed first; then a site is repeatedly inserted between each pair of neighbors, which refines the honeycomb: a
multilevel method, as in [Du06].

At the minimum of E, areas of cells are proportional to rho^(-1/2) [Gersho79]. The density of sites should be
proportional to the painted density D, so rho = D².
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.mirror import Mirror
from .domain import Domain
from .exact_cells import CutCells
from .farthest import farthest
from .lbfgs import Memory
from .preconditioner import Springs
from .sampled_cells import SampledCells
from .voronoi import EVERYWHERE, sites_on

STEPS_KEPT = 7
LONGEST_STEP = 0.5  # fraction of the distance to the next site
FEWEST_SITES = 260  # minimum count for multilevel placement
LEAST_CELL = 0.75  # fraction of the mean amount of a cell: sites with smaller cells are crowded
LEAST_LATE_CELL = 0.6  # the same at the finest level
# Fractions of the final rounds after which crowded sites move to gaps.
SPREAD_AT_ONCE, SPREAD_AFTER_LEVELS = (0.25, 0.5), (0.5,)
GAP_SAMPLES = 8  # samples for each site, to find the widest gaps
RING = 7  # a site and its neighbors in a honeycomb
LEAST_PAIR = 0.4  # fraction of the area shared by two neighbors in a honeycomb: smaller pairs are not refined
GAP_ROUNDS = 4  # adjacent gaps are filled in succession
START_SAMPLES = 16  # samples for each initial site
SAMPLES_PER_SITE = 64  # at coarse levels
LEAST_SAMPLES = 2000
FIRST_ITERATIONS, COARSE_ITERATIONS = 6, 3
RISE = 0.01  # maximum relative increase of the energy by an accepted step, if allowed
ENOUGH = 1e-4  # relative decrease of the energy below which iterations end


def place(
    mesh: TriMesh,
    count: int,
    seed: int,
    iterations: int,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    mirror: Mirror | None = None,
    device: str = "cpu",
    progress: Callable[[float], None] = lambda part: None,
) -> SurfacePoints:
    """Return `count` sites, placed evenly, as `SurfacePoints` that depend only on the arguments.

    mesh: a checked `TriMesh`; iterations: maximum at the finest level, 0 for random sites; density (V,) ≥ 0 of vertices
    and texture (`Texture`) are multiplied; mirror: `Mirror` for symmetric sites: the second half are images of the
    first, in the same order, with an odd site in between; progress(part): receives the completed fraction, may raise to
    cancel. Raises `HairError`.
    """
    domain = Domain(mesh, count, density, texture, mirror, device)
    if mirror is None or count == 1:
        return _place(domain, count, seed, iterations, device, progress)
    # The mirror separates the cells of a site and of its image: half of the surface is an independent problem.
    half = _place(domain, count - count // 2, seed, iterations, device, progress)
    return domain.symmetric(half, count)


@dataclass(frozen=True)
class _Descent:
    sites: SurfacePoints
    energies: np.ndarray


def _place(domain, count, seed, iterations, device, progress):
    random = np.random.Generator(np.random.PCG64(seed))
    if iterations == 0:
        return domain.samples(count, random)[0]
    counts = [count]
    while counts[0] > FEWEST_SITES:
        counts.insert(0, _coarser(counts[0], 0.0))
    sites = _start(domain, counts[0], random)
    # If triangles are much smaller than cells, samples suffice for most of the descent.
    is_fine = len(domain.amounts) > 2 * SAMPLES_PER_SITE * count
    for level in range(len(counts)):
        if level == len(counts) - 1 and not is_fine:
            break
        level_progress = _share(progress, 0.3 * level / len(counts), 0.3 * (level + 1) / len(counts))
        points, part = domain.samples(max(SAMPLES_PER_SITE * len(sites), LEAST_SAMPLES))
        cells = SampledCells(domain, points, part, len(sites), device)
        rounds = COARSE_ITERATIONS if level else FIRST_ITERATIONS
        sites = _descend(domain, cells, sites, rounds, device, level_progress, is_strict=False).sites
        if level < len(counts) - 1:
            if level == 0:
                # No pairs cross a border: the number of missing sites doubles at each level.
                missing = max(0.0, 3.0 * len(sites) - 6.0 - _pair_count(domain, cells, sites, device))
                for finer in range(len(counts) - 2, 0, -1):
                    counts[finer] = _coarser(counts[finer + 1], missing * 2.0**finer)
            sites = _refined(domain, cells, points, sites, counts[level + 1], device)
    # Sites from coarser levels need half of the rounds.
    rounds = iterations if len(counts) == 1 else (iterations + 1) // 2
    last_progress, cells = _share(progress, 0.3, 1.0), CutCells(domain, count, device)
    spread_at = {int(part * rounds) for part in (SPREAD_AT_ONCE if len(counts) == 1 else SPREAD_AFTER_LEVELS)}
    return _descend(domain, cells, sites, rounds, device, last_progress, is_strict=False, spread_at=spread_at).sites


def _start(domain, count, random):
    """Return `count` sites that are far from each other."""
    points, _ = domain.samples(START_SAMPLES * count, random)
    squares = EVERYWHERE**2 * (1.0 + random.random(len(points)))
    return points[farthest(domain, points, squares, _wanted(domain, points[:0], count, points))]


def _coarser(count, missing):
    """Return the number of sites that refine to `count`: on a closed surface n sites have 3n - 6 pairs."""
    return round((count + 6.0 + missing) / 4.0)


def _share(progress, first, last):
    """Return the progress callback of a stage that covers the fractions `first` to `last` of the whole."""
    return lambda part: progress(first + (last - first) * part)


def _descend(
    domain, cells, sites, iterations, device, progress, steps_kept=STEPS_KEPT, is_strict=True, spread_at=frozenset()
):
    """Return the best sites of the iterations; with `is_strict` no iteration raises the energy.

    A site that moves to another side of the surface may raise the energy a little; a line search would cost as much as
    another iteration. spread_at: iterations before which crowded sites move to the widest gaps.
    """
    memory = Memory(steps_kept)
    progress(0.0)
    state = best = _State(domain, cells, sites, device)
    energies = [state.energy]
    for iteration in range(iterations):
        progress((iteration + 0.1) / iterations)
        spread = _spread(domain, state, device) if iteration in spread_at else None
        if spread is not None:
            memory.clear()
            state = _State(domain, cells, spread, device)
        progress((iteration + 0.5) / iterations)
        moves = memory.direction(state.gradient, state.moves if steps_kept else state.lloyd_moves)
        moved = _State(domain, cells, state.stepped(moves), device)
        if moved.energy > (1.0 if is_strict else 1.0 + RISE) * state.energy and len(memory):
            memory.clear()
            moved = _State(domain, cells, state.stepped(state.to_centroids), device)
        if is_strict and moved.energy > state.energy:
            moved = _State(domain, cells, state.stepped(0.5 * state.to_centroids), device)
            if moved.energy > state.energy:
                break
        memory.add(moved.places - state.places, moved.gradient - state.gradient)
        is_enough = abs(state.energy - moved.energy) < ENOUGH * state.energy
        state = moved
        best = min(best, state, key=lambda s: s.energy)
        energies.append(state.energy)
        if is_enough:
            break
    progress(1.0)
    return _Descent(best.sites, np.array(energies))


def _spread(domain, state, device):
    """Return sites after crowded sites move to the widest gaps, which no descent does; None if no site is crowded.

    With a few distant initial sites, tips of thin parts have too many sites.
    """
    sites = state.sites
    # Masses are integrals of D²; at the minimum they are proportional to D.
    amounts = state.sums.masses / np.maximum(domain.density_at(sites), 1e-3)
    crowded = _crowded(amounts, LEAST_LATE_CELL, state.on)
    if not len(crowded):
        return None
    rest = sites[np.delete(np.arange(len(sites)), crowded)]
    points, part = domain.samples(GAP_SAMPLES * len(sites))
    cells = SampledCells(domain, points, part, len(rest), device)
    gaps = points[_widest_gaps(domain, cells, points, rest, len(sites), device)]
    triangle, barycentric = sites.triangle.copy(), sites.barycentric.copy()
    replaced = crowded[: len(gaps)]
    triangle[replaced], barycentric[replaced] = gaps.triangle, gaps.barycentric
    return SurfacePoints(triangle, barycentric)


class _State:
    """Sites with their energy, its gradient (n, 3) along the surface, and inverse (n, 1) = 1 / (2 m_i)."""

    def __init__(self, domain, cells, sites, device):
        self.sites, self._domain = sites, domain
        self.places = positions(domain.mesh, sites).astype(np.float64)
        self._device, self.on = device, sites_on(domain, sites, device)
        self.sums = cells.sums(self.on)
        self.energy = self.sums.energy
        normals = domain.normals[sites.triangle]
        gradient = -2.0 * self.sums.moments
        self.gradient = gradient - np.einsum("ni,ni->n", gradient, normals)[:, None] * normals
        filled = self.sums.masses > 0.0
        self.inverse = np.where(filled, 0.5 / np.where(filled, self.sums.masses, 1.0), 0.0)[:, None]

    def moves(self, gradient):
        """Return approximate moves (n, 3) that change the gradient by (n, 3)."""
        return Springs(self.on, self.sums.masses, self._device).moves(gradient)

    def lloyd_moves(self, gradient):
        """Return moves (n, 3) like `moves`, without coupling between cells."""
        return self.inverse * gradient

    @property
    def to_centroids(self):
        """Lloyd's step (n, 3)."""
        return 2.0 * self.inverse * self.sums.moments

    def stepped(self, step):
        """Return sites moved along the surface by (n, 3), limited to a fraction of the distance to the next site."""
        lengths = np.linalg.norm(step, axis=1)
        longest = LONGEST_STEP * self.sums.spacing
        shortened = np.where(lengths > longest, longest / np.where(lengths > 0.0, lengths, 1.0), 1.0)
        moved = self._domain.moved(self.sites, self.places + shortened[:, None] * step)
        rests = lengths == 0.0
        return SurfacePoints(
            np.where(rests, self.sites.triangle, moved.triangle),
            np.where(rests[:, None], self.sites.barycentric, moved.barycentric),
        )


def _pairs(domain, cells, sites, device):
    """Return the pair (Q,) of nearest sites of each sample, as neighbors.

    A pair is encoded as n × the lower index + the higher index, or -1 for sites on different islands.
    """
    first, second = cells.nearest_two(sites_on(domain, sites, device))
    islands = domain.islands[sites.triangle]
    is_pair = (second >= 0) & (islands[first] == islands[second])
    return np.where(is_pair, np.minimum(first, second) * len(sites) + np.maximum(first, second), -1)


def _pair_count(domain, cells, sites, device):
    pairs = _pairs(domain, cells, sites, device)
    return len(np.unique(pairs[pairs >= 0]))


def _thinned(domain, cells, sites, device):
    """Return sites without crowded sites: the most crowded sites are removed first, but no two neighbors.

    Thin parts and corners have too many sites of a coarse level, which no descent moves elsewhere.
    """
    on = sites_on(domain, sites, device)
    amounts = np.bincount(cells.nearest(on), minlength=len(sites))
    removed = _crowded(amounts, LEAST_CELL, on)
    is_kept = np.ones(len(sites), bool)
    is_kept[removed] = False
    numbers = np.maximum(np.cumsum(is_kept) - 1, 0)
    numbers[removed] = numbers[on.around.numpy()[removed, RING - 1]]  # a nearby site takes over the cell
    cells.renumber(numbers)
    return sites[is_kept]


def _crowded(amounts, least, on):
    """Return sites whose cells have less than `least` of the mean amount, smallest first, without neighbors."""
    crowded = np.flatnonzero(amounts < least * amounts.mean())
    rings = on.around.numpy()[crowded, :RING]
    is_kept = np.ones(len(amounts), bool)
    for rank in np.argsort(amounts[crowded], kind="stable"):
        if is_kept[rings[rank]].all():
            is_kept[crowded[rank]] = False
    return crowded[~is_kept[crowded]]


def _refined(domain, cells, points, sites, count, device):
    """Return `count` sites: `sites`, a new site between each pair of neighbors, and the rest in the widest gaps.

    Pairs that share little of the surface are not refined, which thins out sites that are too close, for example where
    the surface bends within the width of a cell. New sites are chosen among `points`, the samples of the cells, so
    their density is positive.
    """
    sites = _thinned(domain, cells, sites, device)
    pairs = _pairs(domain, cells, sites, device)
    known, which, sizes = np.unique(pairs, return_inverse=True, return_counts=True)
    places = positions(domain.mesh, sites)
    middles = 0.5 * (places[known // len(sites)] + places[known % len(sites)])
    squares = np.sum((cells.places - middles[which]) ** 2, axis=1)
    # In a honeycomb of n sites, each of the 3n pairs has an equal share.
    is_wide = (known >= 0) & (sizes > LEAST_PAIR * len(points) / (3.0 * len(sites)))
    ranked = np.argsort(-sizes, kind="stable")
    is_wide = is_wide[ranked]
    between = _firsts(which, squares)[ranked[is_wide]]
    islands = domain.islands[points.triangle]
    chosen = _within(between, islands, _wanted(domain, sites, count))
    sites = sites.joined(domain.moved(points[chosen], middles[which[chosen]]))
    for _ in range(GAP_ROUNDS):
        if len(sites) < count:
            sites = sites.joined(points[_widest_gaps(domain, cells, points, sites, count, device)])
    lacking = count - len(sites)  # sites are lacking where islands are smaller than a cell
    return sites.joined(points[np.linspace(0, len(points) - 1, lacking).astype(int)]) if lacking else sites


def _widest_gaps(domain, cells, points, sites, count, device):
    """Return indices of the samples farthest from all sites and from each other, at most as many as are missing.

    Each cell has one candidate.
    """
    first = cells.nearest(sites_on(domain, sites, device))
    squares = np.sum((cells.places - positions(domain.mesh, sites)[first]) ** 2, axis=1)
    corners = _firsts(first, -squares * cells.densities)
    return corners[farthest(domain, points[corners], squares[corners], _wanted(domain, sites, count))]


def _wanted(domain, sites, count, candidates=None):
    """Return (islands,) the number of further sites of each island, for its share of `count`."""
    island_count = int(domain.islands.max()) + 1
    amounts = np.bincount(domain.islands[domain.parts.triangle], weights=domain.amounts, minlength=island_count)
    present = np.bincount(domain.islands[sites.triangle], minlength=island_count)
    if candidates is not None:
        amounts *= np.bincount(domain.islands[candidates.triangle], minlength=island_count) > 0
    lacking = np.maximum(amounts / amounts.sum() * count - present, 0.0)
    ends = np.round(np.cumsum(lacking) * ((count - len(sites)) / max(lacking.sum(), 1e-30)))
    return np.diff(ends, prepend=0.0).astype(int)


def _within(ranked, islands, wanted):
    """Return the first ranked samples of each island, up to its wanted number."""
    order = np.argsort(islands[ranked], kind="stable")
    found = islands[ranked][order]
    place = np.arange(len(order)) - np.searchsorted(found, found)
    return ranked[np.sort(order[place < wanted[found]])]


def _firsts(groups, keys):
    """Return the index of the smallest key of each non-empty group, in order; the lowest index among equal keys."""
    least = np.full(groups.max() + 1, np.inf)
    np.minimum.at(least, groups, keys)
    found = np.flatnonzero(keys == least[groups])[::-1]
    firsts = np.full(len(least), -1)
    firsts[groups[found]] = found  # later assignments, of lower indices, take precedence
    return firsts[firsts >= 0]
