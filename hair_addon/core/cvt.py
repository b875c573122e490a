# SPDX-License-Identifier: GPL-3.0-or-later
"""Centroidal Voronoi tessellation of a surface: where guides are rooted  [Du99], [Report12] section 2.3.

The cell V_i of a site s_i is the part of the surface that is nearer to it than to any other (voronoi.py). With a
density rho, the energy is E = sum_i ∫_{V_i} rho(x) |x - s_i|² dA, and its gradient 2 m_i (s_i - c_i), c_i being the
centroid of the cell and m_i its mass. Lloyd's step, to the surface point nearest to the centroid, never raises E.
L-BFGS [Liu09] begins with steps that springs between neighbours would take (springs.py), and learns better ones; where
one raises E, it takes Lloyd's and begins again.

From a random start any descent ends in grains of honeycomb that do not match. So few sites that are far from each other
(farthest.py) are relaxed first, and then each pair of neighbours gets a site in its middle, which makes a finer
honeycomb out of a coarse one, again and again: a multilevel method, as in [Du06].

Where E is least, areas of cells go with rho^(-1/2) [Gersho79]. Sites are to go with the density D that an artist
painted, so rho = D².
"""

from dataclasses import dataclass

import numpy as np

from .cut_cells import CutCells
from .farthest import farthest
from .ground import Ground
from .lbfgs import Memory
from .mesh import SurfacePoints, positions
from .sampled_cells import SampledCells
from .springs import Springs
from .voronoi import EVERYWHERE, sites_on

STEPS_KEPT = 7
LONGEST_STEP = 0.5  # of the way to the next site
FEWEST_SITES = 260  # from so many on, fewer are placed first
LEAST_PAIR = 0.4  # of the part of the surface that two neighbours share in a honeycomb: others get no site between
GAP_ROUNDS = 4  # gaps that share a corner are filled one after the other
START_SAMPLES = 16  # for each site of the start
SAMPLES_PER_SITE = 64  # while they are few
LEAST_SAMPLES = 2000
FIRST_ITERATIONS, COARSE_ITERATIONS = 6, 3
RISE = 0.01  # of the energy: so much a step may raise it on the way to a better place, where that is allowed
ENOUGH = 1e-4  # an iteration that lowers the energy by less than that part of it was the last

# Second moment of a regular hexagon about its centre by its area squared: no tessellation of the plane has less.
HEXAGON_MOMENT = 5.0 / (18.0 * np.sqrt(3.0))


@dataclass(frozen=True)
class Relaxation:
    """sites: `SurfacePoints`; energies [m⁴]: before the first iteration and after each, until they rest."""

    sites: SurfacePoints
    energies: np.ndarray


@dataclass(frozen=True)
class Quality:
    """How even a distribution is: 1 and 0 for an endless flat honeycomb.

    relative_energy: E by that of n regular hexagons with equal shares of ∫ D dA, HEXAGON_MOMENT (∫ D dA)² / n;
    share_variation: standard deviation by mean of the cells' shares of ∫ D dA.
    """

    relative_energy: float
    share_variation: float


def place(
    mesh, count, seed, iterations, *, density=None, texture=None, mirror=None, device="cpu", progress=lambda part: None
):
    """`count` evenly placed sites, as `SurfacePoints`: the same for the same seed.

    mesh: a checked `TriMesh`; iterations: at most, with all sites; 0 leaves them random. density (V,) ≥ 0 per vertex
    and texture (`Texture`) multiply; mirror: `Mirror` by which sites are symmetric: the second half are images of the
    first, in the same order, and an odd one lies between. progress(part): told which part of the work is done, and may
    raise to stop.
    """
    ground = Ground(mesh, count, density, texture, mirror, device)
    if mirror is None or count == 1:
        return _place(ground, count, seed, iterations, device, progress)
    # The border of a site's cell and its image's is the mirror: half of the surface is a problem of its own.
    half = _place(ground, count - count // 2, seed, iterations, device, progress)
    return ground.symmetric(half, count)


def relax(mesh, sites, iterations, density=None, device="cpu", progress=lambda part: None, steps_kept=STEPS_KEPT):
    """Move sites (`SurfacePoints` on a checked `TriMesh`) until they are evenly placed for a density (V,) ≥ 0.

    Sites stay on the surface, and where the density is above zero if they began there. progress as in `place`;
    steps_kept: 0 for Lloyd's method alone. Returns a `Relaxation`.
    """
    ground = Ground(mesh, len(sites), density, device=device)
    cells = CutCells(ground, len(sites), device)
    descent = _descend(ground, cells, sites, iterations, device, progress, steps_kept=steps_kept)
    return Relaxation(descent.sites, descent.energies * ground.mass * ground.densest**2 * ground.size**4)


def measure(mesh, sites, density=None, device="cpu"):
    """`Quality` of sites on a checked mesh for a density (V,) or None."""
    ground = Ground(mesh, len(sites), density, device=device)
    neighbours = sites_on(ground, sites, device)
    total = ground.amounts.sum()
    energy = CutCells(ground, len(sites), device).sums(neighbours).energy * ground.mass
    shares = CutCells(ground, len(sites), device, ground.densities / total).sums(neighbours).masses
    return Quality(energy / (HEXAGON_MOMENT * total**2 / len(sites)), float(shares.std() / shares.mean()))


@dataclass(frozen=True)
class _Descent:
    sites: SurfacePoints
    energies: np.ndarray


def _place(ground, count, seed, iterations, device, progress):
    random = np.random.Generator(np.random.PCG64(seed))
    if iterations == 0:
        return ground.samples(count, random)[0]
    counts = [count]
    while counts[0] > FEWEST_SITES:
        counts.insert(0, _coarser(counts[0], 0.0))
    sites = _start(ground, counts[0], random)
    # Where triangles are much smaller than cells, samples do for most of the way.
    is_fine = len(ground.amounts) > 2 * SAMPLES_PER_SITE * count
    for level in range(len(counts)):
        told = _share(progress, 0.3 * level / len(counts), 0.3 * (level + 1) / len(counts))
        if level < len(counts) - 1 or is_fine:
            points, part = ground.samples(max(SAMPLES_PER_SITE * len(sites), LEAST_SAMPLES))
            cells = SampledCells(ground, points, part, len(sites), device)
            rounds = COARSE_ITERATIONS if level else FIRST_ITERATIONS
            sites = _descend(ground, cells, sites, rounds, device, told, is_strict=False).sites
        if level < len(counts) - 1:
            if level == 0:
                # A border has no pairs across it: so many sites are missing, twice as many from level to level.
                missing = max(0.0, 3.0 * len(sites) - 6.0 - _pair_count(ground, cells, sites, device))
                for finer in range(len(counts) - 2, 0, -1):
                    counts[finer] = _coarser(counts[finer + 1], missing * 2.0**finer)
            sites = _refined(ground, cells, points, sites, counts[level + 1], device)
    # Sites that come from fewer, evened out before, need half of the rounds.
    rounds = iterations if len(counts) == 1 else (iterations + 1) // 2
    told = _share(progress, 0.3, 1.0)
    return _descend(ground, CutCells(ground, count, device), sites, rounds, device, told, is_strict=False).sites


def _start(ground, count, random):
    """`count` sites that are far from each other."""
    points, _ = ground.samples(START_SAMPLES * count, random)
    squares = EVERYWHERE**2 * (1.0 + random.random(len(points)))
    return points[farthest(ground, points, squares, _wanted(ground, points[:0], count))]


def _coarser(count, missing):
    """How many sites become `count` when every pair gets one: on a closed surface n sites have 3n - 6 pairs."""
    return round((count + 6.0 + missing) / 4.0)


def _share(progress, first, last):
    """The progress of a stage that makes up the part between `first` and `last` of the whole."""
    return lambda part: progress(first + (last - first) * part)


def _descend(ground, cells, sites, iterations, device, progress, steps_kept=STEPS_KEPT, is_strict=True):
    """The best sites of at most so many iterations, none of which raised the energy unless `is_strict` is false.

    A site that comes to another side, by its normal, may raise it a little: to try shorter steps instead costs as much
    as going on does.
    """
    memory = Memory(steps_kept)
    state = best = _State(ground, cells, sites, device)
    energies = [state.energy]
    for iteration in range(iterations):
        progress(iteration / iterations)
        moves = memory.direction(state.gradient, state.moves if steps_kept else state.lloyd_moves)
        moved = _State(ground, cells, state.stepped(moves), device)
        if moved.energy > (1.0 if is_strict else 1.0 + RISE) * state.energy and len(memory):
            memory.clear()
            moved = _State(ground, cells, state.stepped(state.to_centroids), device)
        if is_strict and moved.energy > state.energy:
            moved = _State(ground, cells, state.stepped(0.5 * state.to_centroids), device)
            if moved.energy > state.energy:
                break
        memory.add(moved.places - state.places, moved.gradient - state.gradient)
        is_enough = abs(state.energy - moved.energy) < ENOUGH * state.energy
        state = moved
        best = min(best, state, key=lambda s: s.energy)
        energies.append(state.energy)
        if is_enough:
            break
    return _Descent(best.sites, np.array(energies))


class _State:
    """Sites with their energy, its gradient (n, 3) along the surface, and inverse (n, 1) = 1 / (2 m_i)."""

    def __init__(self, ground, cells, sites, device):
        self.sites, self._ground = sites, ground
        self.places = positions(ground.mesh, sites).astype(np.float64)
        self._device, self._on = device, sites_on(ground, sites, device)
        self.sums = cells.sums(self._on)
        self.energy = self.sums.energy
        normals = ground.normals[sites.triangle]
        gradient = -2.0 * self.sums.moments
        self.gradient = gradient - np.einsum("ni,ni->n", gradient, normals)[:, None] * normals
        filled = self.sums.masses > 0.0
        self.inverse = np.where(filled, 0.5 / np.where(filled, self.sums.masses, 1.0), 0.0)[:, None]

    def moves(self, gradient):
        """(n, 3): nearly the moves that change the gradient by (n, 3)."""
        return Springs(self._on, self.sums.masses, self._device).moves(gradient)

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


def _pairs(ground, cells, sites, device):
    """Neighbours as sampled cells know them: of each sample the pair (Q,) of sites that are nearest.

    A pair is n × the lower site + the higher, or -1 where sites are on different islands.
    """
    first, second = cells.nearest_two(sites_on(ground, sites, device))
    islands = ground.islands[sites.triangle]
    is_pair = (second >= 0) & (islands[first] == islands[second])
    return np.where(is_pair, np.minimum(first, second) * len(sites) + np.maximum(first, second), -1)


def _pair_count(ground, cells, sites, device):
    pairs = _pairs(ground, cells, sites, device)
    return len(np.unique(pairs[pairs >= 0]))


def _refined(ground, cells, points, sites, count, device):
    """`count` sites out of fewer: one more between neighbours, and what is lacking in the widest gaps.

    Neighbours that are closer than most get none: so sites leave where few of them stood too close, as they do where a
    surface bends faster than its cells are wide. New sites are some of the `points` that sampled cells are made of, so
    they have density.
    """
    pairs = _pairs(ground, cells, sites, device)
    known, which, sizes = np.unique(pairs, return_inverse=True, return_counts=True)
    places = positions(ground.mesh, sites)
    middles = 0.5 * (places[known // len(sites)] + places[known % len(sites)])
    squares = np.sum((cells.places - middles[which]) ** 2, axis=1)
    # In a honeycomb of n sites each of 3n pairs has as large a part.
    is_wide = (known >= 0) & (sizes > LEAST_PAIR * len(points) / (3.0 * len(sites)))
    ranked = np.argsort(-sizes, kind="stable")
    is_wide = is_wide[ranked]
    between = _firsts(which, squares)[ranked[is_wide]]
    islands = ground.islands[points.triangle]
    chosen = _within(between, islands, _wanted(ground, sites, count))
    sites = sites.joined(ground.moved(points[chosen], middles[which[chosen]]))
    for _ in range(GAP_ROUNDS):
        if len(sites) < count:
            sites = sites.joined(points[_widest_gaps(ground, cells, points, sites, count, device)])
    lacking = count - len(sites)  # where islands are smaller than a cell
    return sites.joined(points[np.linspace(0, len(points) - 1, lacking).astype(int)]) if lacking else sites


def _widest_gaps(ground, cells, points, sites, count, device):
    """Samples, indices of them, that are farthest from all sites and from each other: as many as are lacking, at most.

    Each cell has one to offer.
    """
    first = cells.nearest(sites_on(ground, sites, device))
    squares = np.sum((cells.places - positions(ground.mesh, sites)[first]) ** 2, axis=1)
    corners = _firsts(first, -squares * cells.densities)
    return corners[farthest(ground, points[corners], squares[corners], _wanted(ground, sites, count))]


def _wanted(ground, sites, count):
    """(islands,) how many more sites each island is to have, so that all have their shares of `count`."""
    island_count = int(ground.islands.max()) + 1
    amounts = np.bincount(ground.islands[ground.parts.triangle], weights=ground.amounts, minlength=island_count)
    present = np.bincount(ground.islands[sites.triangle], minlength=island_count)
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
