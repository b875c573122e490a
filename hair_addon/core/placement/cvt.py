# SPDX-License-Identifier: GPL-3.0-or-later
"""Centroidal Voronoi tessellation of a surface, for guide roots  [Du99], [Report12] section 2.3.

The cell V_i of a site s_i is the part of the surface that is nearer to it than to any other (voronoi.py). With a
density rho, the energy is E = sum_i ∫_{V_i} rho(x) |x - s_i|² dA, and its gradient 2 m_i (s_i - c_i), c_i being the
centroid of the cell and m_i its mass. Lloyd's step, to the surface point nearest to the centroid, never raises E.
L-BFGS [Liu09] starts with the Hessian of springs between neighbours (preconditioner.py) and improves it; if a step
raises E, it takes Lloyd's step and restarts.

From a random start any descent ends in mismatched honeycomb grains. So a few sites that are far from each other
(farthest.py) are relaxed first, and then a site is inserted between each pair of neighbours, which refines the
honeycomb, repeatedly: a multilevel method, as in [Du06].

At the minimum of E, areas of cells are proportional to rho^(-1/2) [Gersho79]. Sites are to be proportional to the
painted density D, so rho = D².
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.mirror import Mirror
from ..geometry.texture import Texture
from .domain import Domain
from .exact_cells import CutCells
from .farthest import farthest
from .lbfgs import Memory
from .preconditioner import Springs
from .sampled_cells import SampledCells
from .voronoi import EVERYWHERE, sites_on

STEPS_KEPT = 7
LONGEST_STEP = 0.5  # of the way to the next site
FEWEST_SITES = 260  # minimum count for multilevel placement
LEAST_CELL = 0.75  # of the mean amount in a cell: sites of smaller ones are crowded
LEAST_LATE_CELL = 0.6  # with all sites
SPREAD_AT_ONCE, SPREAD_AFTER_LEVELS = (0.25, 0.5), (0.5,)  # of the rounds with all sites: crowded ones go to gaps
GAP_SAMPLES = 8  # for each site, where a few are to go to the widest gaps
RING = 7  # a site and its neighbours in a honeycomb
LEAST_PAIR = 0.4  # of the part of the surface that two neighbours share in a honeycomb: others get no site between
GAP_ROUNDS = 4  # adjacent gaps are filled one after the other
START_SAMPLES = 16  # for each site of the start
SAMPLES_PER_SITE = 64  # while they are few
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
    """`count` evenly placed sites, as `SurfacePoints`: the same for the same seed.

    mesh: a checked `TriMesh`; iterations: at most, with all sites; 0 leaves them random. density (V,) ≥ 0 per vertex
    and texture (`Texture`) multiply; mirror: `Mirror` by which sites are symmetric: the second half are images of the
    first, in the same order, and an odd one lies between. progress(part): told which part of the work is done, and may
    raise to stop.
    """
    domain = Domain(mesh, count, density, texture, mirror, device)
    if mirror is None or count == 1:
        return _place(domain, count, seed, iterations, device, progress)
    # The mirror is the border between the cells of a site and its image: half of the surface is an independent problem.
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
    # Where triangles are much smaller than cells, samples do for most of the way.
    is_fine = len(domain.amounts) > 2 * SAMPLES_PER_SITE * count
    for level in range(len(counts)):
        if level == len(counts) - 1 and not is_fine:
            break
        told = _share(progress, 0.3 * level / len(counts), 0.3 * (level + 1) / len(counts))
        points, part = domain.samples(max(SAMPLES_PER_SITE * len(sites), LEAST_SAMPLES))
        cells = SampledCells(domain, points, part, len(sites), device)
        rounds = COARSE_ITERATIONS if level else FIRST_ITERATIONS
        sites = _descend(domain, cells, sites, rounds, device, told, is_strict=False).sites
        if level < len(counts) - 1:
            if level == 0:
                # There are no pairs across a border: the missing sites double from level to level.
                missing = max(0.0, 3.0 * len(sites) - 6.0 - _pair_count(domain, cells, sites, device))
                for finer in range(len(counts) - 2, 0, -1):
                    counts[finer] = _coarser(counts[finer + 1], missing * 2.0**finer)
            sites = _refined(domain, cells, points, sites, counts[level + 1], device)
    # Sites refined from relaxed coarser ones need half of the rounds.
    rounds = iterations if len(counts) == 1 else (iterations + 1) // 2
    told, cells = _share(progress, 0.3, 1.0), CutCells(domain, count, device)
    spread_at = {int(part * rounds) for part in (SPREAD_AT_ONCE if len(counts) == 1 else SPREAD_AFTER_LEVELS)}
    return _descend(domain, cells, sites, rounds, device, told, is_strict=False, spread_at=spread_at).sites


def _start(domain, count, random):
    """`count` sites that are far from each other."""
    points, _ = domain.samples(START_SAMPLES * count, random)
    squares = EVERYWHERE**2 * (1.0 + random.random(len(points)))
    return points[farthest(domain, points, squares, _wanted(domain, points[:0], count, points))]


def _coarser(count, missing):
    """Number of sites that refine to `count`: on a closed surface n sites have 3n - 6 pairs."""
    return round((count + 6.0 + missing) / 4.0)


def _share(progress, first, last):
    """The progress of a stage that makes up the part between `first` and `last` of the whole."""
    return lambda part: progress(first + (last - first) * part)


def _descend(
    domain, cells, sites, iterations, device, progress, steps_kept=STEPS_KEPT, is_strict=True, spread_at=frozenset()
):
    """The best sites of the given iterations, none of which raised the energy unless `is_strict` is false.

    A site that comes to another side, by its normal, may raise it a little: to try shorter steps instead costs as much
    as going on does. spread_at: iterations before which crowded sites go to the widest gaps.
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
    """Sites of which crowded ones have gone to the widest gaps, where no descent takes them; None if none has.

    Where a few sites begin far from each other, tips of thin parts have more than their share.
    """
    sites = state.sites
    # Masses are of D², so that at the minimum they are proportional to D.
    amounts = state.sums.masses / np.maximum(domain.density_at(sites), 1e-3)
    crowded = _crowded(amounts, LEAST_LATE_CELL, state.on)
    if not len(crowded):
        return None
    rest = sites[np.delete(np.arange(len(sites)), crowded)]
    points, part = domain.samples(GAP_SAMPLES * len(sites))
    cells = SampledCells(domain, points, part, len(rest), device)
    gaps = points[_widest_gaps(domain, cells, points, rest, len(sites), device)]
    triangle, barycentric = sites.triangle.copy(), sites.barycentric.copy()
    gone = crowded[: len(gaps)]
    triangle[gone], barycentric[gone] = gaps.triangle, gaps.barycentric
    return SurfacePoints(triangle, barycentric)


class _State:
    """Sites with their energy, its gradient (n, 3) along the surface, and inverse (n, 1) = 1 / (2 m_i)."""

    def __init__(self, domain, cells, sites, device):
        self.sites, self._ground = sites, domain
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
        """(n, 3): nearly the moves that change the gradient by (n, 3)."""
        return Springs(self.on, self.sums.masses, self._device).moves(gradient)

    def lloyd_moves(self, gradient):
        """(n, 3): the same, where no cell knew of its neighbours."""
        return self.inverse * gradient

    @property
    def to_centroids(self):
        """(n, 3): Lloyd's step."""
        return 2.0 * self.inverse * self.sums.moments

    def stepped(self, step):
        """Sites moved along the surface by (n, 3), no farther than leaves the cells their order."""
        lengths = np.linalg.norm(step, axis=1)
        longest = LONGEST_STEP * self.sums.spacing
        shortened = np.where(lengths > longest, longest / np.where(lengths > 0.0, lengths, 1.0), 1.0)
        moved = self._ground.moved(self.sites, self.places + shortened[:, None] * step)
        rests = lengths == 0.0
        return SurfacePoints(
            np.where(rests, self.sites.triangle, moved.triangle),
            np.where(rests[:, None], self.sites.barycentric, moved.barycentric),
        )


def _pairs(domain, cells, sites, device):
    """Neighbours from sampled cells: the pair (Q,) of nearest sites of each sample.

    A pair is n × the lower site + the higher, or -1 where sites are on different islands.
    """
    first, second = cells.nearest_two(sites_on(domain, sites, device))
    islands = domain.islands[sites.triangle]
    is_pair = (second >= 0) & (islands[first] == islands[second])
    return np.where(is_pair, np.minimum(first, second) * len(sites) + np.maximum(first, second), -1)


def _pair_count(domain, cells, sites, device):
    pairs = _pairs(domain, cells, sites, device)
    return len(np.unique(pairs[pairs >= 0]))


def _thinned(domain, cells, sites, device):
    """Sites without crowded ones, of which the most crowded go first, and no neighbours of those that go.

    Thin parts and corners hold more sites of a coarse level than their share, which no descent moves elsewhere.
    """
    on = sites_on(domain, sites, device)
    amounts = np.bincount(cells.nearest(on), minlength=len(sites))
    gone = _crowded(amounts, LEAST_CELL, on)
    is_kept = np.ones(len(sites), bool)
    is_kept[gone] = False
    numbers = np.maximum(np.cumsum(is_kept) - 1, 0)
    numbers[gone] = numbers[on.around.numpy()[gone, RING - 1]]  # those near it have its cell now
    cells.renumber(numbers)
    return sites[is_kept]


def _crowded(amounts, least, on):
    """Indices of sites whose cells hold less than `least` of the mean amount, the smallest first, and no neighbours."""
    crowded = np.flatnonzero(amounts < least * amounts.mean())
    rings = on.around.numpy()[crowded, :RING]
    is_kept = np.ones(len(amounts), bool)
    for rank in np.argsort(amounts[crowded], kind="stable"):
        if is_kept[rings[rank]].all():
            is_kept[crowded[rank]] = False
    return crowded[~is_kept[crowded]]


def _refined(domain, cells, points, sites, count, device):
    """Refine to `count` sites: one between each pair of neighbours, and the rest in the widest gaps.

    Neighbours that are closer than most get none: so sites leave where few of them stood too close, as they do where a
    surface bends faster than its cells are wide. New sites are some of the `points` that sampled cells are made of, so
    they have density.
    """
    sites = _thinned(domain, cells, sites, device)
    pairs = _pairs(domain, cells, sites, device)
    known, which, sizes = np.unique(pairs, return_inverse=True, return_counts=True)
    places = positions(domain.mesh, sites)
    middles = 0.5 * (places[known // len(sites)] + places[known % len(sites)])
    squares = np.sum((cells.places - middles[which]) ** 2, axis=1)
    # In a honeycomb of n sites each of 3n pairs has as large a part.
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
    lacking = count - len(sites)  # where islands are smaller than a cell
    return sites.joined(points[np.linspace(0, len(points) - 1, lacking).astype(int)]) if lacking else sites


def _widest_gaps(domain, cells, points, sites, count, device):
    """Samples, indices of them, that are farthest from all sites and from each other: as many as are lacking, at most.

    Each cell has one to offer.
    """
    first = cells.nearest(sites_on(domain, sites, device))
    squares = np.sum((cells.places - positions(domain.mesh, sites)[first]) ** 2, axis=1)
    corners = _firsts(first, -squares * cells.densities)
    return corners[farthest(domain, points[corners], squares[corners], _wanted(domain, sites, count))]


def _wanted(domain, sites, count, candidates=None):
    """(islands,) how many more sites each island is to have, so that all have their shares of `count`."""
    island_count = int(domain.islands.max()) + 1
    amounts = np.bincount(domain.islands[domain.parts.triangle], weights=domain.amounts, minlength=island_count)
    present = np.bincount(domain.islands[sites.triangle], minlength=island_count)
    if candidates is not None:
        amounts *= np.bincount(domain.islands[candidates.triangle], minlength=island_count) > 0
    lacking = np.maximum(amounts / amounts.sum() * count - present, 0.0)
    ends = np.round(np.cumsum(lacking) * ((count - len(sites)) / max(lacking.sum(), 1e-30)))
    return np.diff(ends, prepend=0.0).astype(int)


def _within(ranked, islands, wanted):
    """Of samples in order of rank those that their islands want."""
    order = np.argsort(islands[ranked], kind="stable")
    found = islands[ranked][order]
    place = np.arange(len(order)) - np.searchsorted(found, found)
    return ranked[np.sort(order[place < wanted[found]])]


def _firsts(groups, keys):
    """Index of the smallest key of each group that there is, groups rising; of equal ones the lowest."""
    least = np.full(groups.max() + 1, np.inf)
    np.minimum.at(least, groups, keys)
    found = np.flatnonzero(keys == least[groups])[::-1]
    firsts = np.full(len(least), -1)
    firsts[groups[found]] = found  # the last one stays
    return firsts[firsts >= 0]
