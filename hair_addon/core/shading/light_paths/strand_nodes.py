# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums over paths by nodes, which are sample points along strands, for light that differs between strands of a voxel.

Nodes store the light that lamps cast on a strand at once, with the shadows and highlights of single strands. This light
has little noise. Later light has more noise and varies less from strand to strand, so it comes from voxels. The light
of an even world also comes from voxels, because rays to lamps do not find it.
"""

import math

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ...kernels.checks import require_count
from . import light_texels, row_sums, voxel_sums
from .strand_grid import StrandGrid

wp.set_module_options({"enable_backward": False})

CHANNELS = 18  # RGB of light at once, later light, light of an even world; each with light in uniform light
_PRIOR = 6.0  # weight of the light of voxels, in paths
_MOST_NODES = 262_144  # of all hair
_LEAST_OF_STRAND = 4
_LONGEST = 2.0  # largest distance of nodes along a strand [voxels]: light of voxels varies along it too
_SAMPLED = 1000  # number of strands whose length is measured

rgb = wp.types.vector(length=3, dtype=wp.float64)


@wp.struct
class _Strands:
    """A system of strands in a grid: their points from `first_point` on, and their nodes from `first_node` on."""

    first_point: int
    point_count: int
    strand_count: int
    first_node: int
    node_count: int  # of each strand


@wp.kernel
def _find_nodes(
    of: _Strands,
    points: wp.array[wp.vec3],
    segments: wp.array[int],
    places: wp.array[wp.vec3],
    out_rows: wp.array[int],
):
    """Find the nodes nearest to places on the axes of segments of a system."""
    index = wp.tid()
    segment = segments[index]
    local = segment - of.first_point
    if local >= 0 and local < of.strand_count * of.point_count:
        start = points[segment]
        along = points[segment + 1] - start
        part = wp.dot(places[index] - start, along) / wp.max(wp.dot(along, along), 1e-30)
        position = float(local % of.point_count) + wp.clamp(part, 0.0, 1.0)
        node = int(position / float(of.point_count - 1) * float(of.node_count))
        node = wp.clamp(node, 0, of.node_count - 1)
        out_rows[index] = of.first_node + local / of.point_count * of.node_count + node


@wp.func
def _ratios_at(ratios: wp.array4d[wp.float64], low: wp.vec3i, place: wp.vec3):
    """Return the three RGB ratios at a place [voxels] in the grid, linear between voxels; low: first voxel with ratios
    along Z, Y, X.
    """
    at_once = rgb()
    later = rgb()
    of_world = rgb()
    weight = wp.vec3(0.0, 0.0, 0.0)
    cell = wp.vec3i(0, 0, 0)
    for axis in range(3):
        at = place[axis] - 0.5 - float(low[2 - axis])
        at = wp.clamp(at, 0.0, float(ratios.shape[2 - axis] - 1))
        cell[axis] = int(at)
        weight[axis] = at - wp.floor(at)
    for corner in range(8):
        x = wp.min(cell[0] + corner % 2, ratios.shape[2] - 1)
        y = wp.min(cell[1] + corner / 2 % 2, ratios.shape[1] - 1)
        z = wp.min(cell[2] + corner / 4, ratios.shape[0] - 1)
        part = wp.where(corner % 2 == 1, weight[0], 1.0 - weight[0])
        part *= wp.where(corner / 2 % 2 == 1, weight[1], 1.0 - weight[1])
        part *= wp.where(corner / 4 == 1, weight[2], 1.0 - weight[2])
        for channel in range(3):
            at_once[channel] += wp.float64(part) * ratios[z, y, x, channel]
            later[channel] += wp.float64(part) * ratios[z, y, x, 3 + channel]
            of_world[channel] += wp.float64(part) * ratios[z, y, x, 6 + channel]
    return at_once, later, of_world


@wp.kernel
def _find_texels(
    of: _Strands,
    points: wp.array[wp.vec3],
    corner: wp.vec3,
    voxel: float,
    ratios: wp.array4d[wp.float64],
    low: wp.vec3i,
    sums: wp.array2d[wp.float64],
    prior: wp.float64,
    out_texels: wp.array[wp.vec4],
):
    node = wp.tid()
    row = of.first_node + node
    even = sums[row, 3] + sums[row, 4] + sums[row, 5]
    known = even / (even + prior)
    position = (float(node % of.node_count) + 0.5) / float(of.node_count) * float(of.point_count - 1)
    below = wp.clamp(int(position), 0, of.point_count - 2)
    first = of.first_point + node / of.node_count * of.point_count + below
    place = points[first] + (position - float(below)) * (points[first + 1] - points[first])
    light = rgb()
    rest = wp.float64(1.0)
    at_once, later, of_world = _ratios_at(ratios, low, (place - corner) / voxel)
    of_lamps = at_once[0] + at_once[1] + at_once[2] + later[0] + later[1] + later[2]
    total = of_lamps + of_world[0] + of_world[1] + of_world[2]
    if even > wp.float64(0.0) and of_lamps > wp.float64(0.0):
        of_rest = (total - of_lamps) / total
        rest = wp.float64(1.0) - known * (wp.float64(1.0) - of_rest)
        for channel in range(3):
            here = sums[row, channel] / wp.max(sums[row, 3 + channel], wp.float64(1e-12))
            # Light of a world is a part of the voxel's, except for its color.
            tint = of_world[channel] - of_rest * (at_once[channel] + later[channel] + of_world[channel])
            light[channel] = known * (here + later[channel] + tint)
    out_texels[node] = wp.vec4(float(light[0]), float(light[1]), float(light[2]), float(rest))


class NodeSums:
    """(nodes, 6) sums over paths of a `StrandGrid`, zero at first: light at once, light in uniform light.

    Systems have no nodes if they are linked, as their sums are common, if the grid contains only some of their strands,
    or if nodes as dense as voxels would be too many.
    """

    def __init__(self, grid: StrandGrid) -> None:
        self.grid = grid
        self._taken = self._even = 0.0  # number of paths, and all their light in uniform light
        systems, needs = {}, {}
        for index, system in enumerate(grid.thinned):
            of = systems[index] = _Strands()
            of.first_point, of.point_count = system.first_point, system.point_count
            ends = [*(other.first_point for other in grid.thinned[1:]), len(grid.points)]
            of.strand_count = (ends[index] - system.first_point) // system.point_count
            is_linked = grid.sums_of_systems.count(grid.sums_of_systems[index]) > 1
            if of.strand_count and system.stride == 1 and system.point_count > 1 and not is_linked:
                needs[index] = _need_of(grid, of)
        first_node, counts = 0, _counts(grid, systems, needs)
        self._systems: dict[int, _Strands] = {index: systems[index] for index in sorted(counts)}
        for index, of in self._systems.items():
            of.first_node, of.node_count = first_node, counts[index]
            first_node += of.strand_count * of.node_count
        self._sums = wp.zeros((first_node, 6), dtype=wp.float64, device=grid.device)

    def __len__(self) -> int:
        return len(self._sums)

    def has(self, system: int) -> bool:
        """Whether a system, by its index, has nodes."""
        return system in self._systems

    def scale(self, weight: float) -> None:
        """Multiply all sums by a weight."""
        self._taken, self._even = weight * self._taken, weight * self._even
        if len(self._sums):
            row_sums.scale(self._sums, weight)

    def add(
        self, segments: wp.array[int], places: wp.array[wp.vec3], light: wp.array[wp.vec3], even: wp.array[wp.vec3]
    ) -> None:
        """Add the light of paths (N,) that start at places on the axes of segments, and their light in uniform light.

        segments: of the grid, which the caller has checked.
        """
        for values in (places, light, even):
            require_count("values by node", len(values), len(segments))
        if not len(segments) or not len(self._sums):
            return
        self._taken, self._even = self._taken + len(segments), self._even + voxel_sums.brightness(even)[0]
        rows = wp.full(len(segments), -1, dtype=int, device=self._sums.device)
        for of in self._systems.values():
            given = [of, self.grid.points, segments, places]
            kernel_cache.launch(_find_nodes, len(segments), given, [rows], rows.device)
        row_sums.add(self._sums, rows, light, even)

    def texels(self, system: int, ratios: wp.array4d[wp.float64], low: tuple[int, int, int]) -> np.ndarray:
        """Return (S, nodes, 4) float32 of a system: RGB relative to the light in uniform light, to which the light of
        voxels is added with the weight in the fourth channel.

        ratios: RGB by `CHANNELS` (Z, Y, X, 9) of the voxels from `low` on, along Z, Y, X.
        """
        of, grid, device = self._systems[system], self.grid, self._sums.device
        texels = wp.empty(of.strand_count * of.node_count, dtype=wp.vec4, device=device)
        prior = wp.float64(max(_PRIOR * self._even / max(self._taken, 1.0), 1e-30))
        given = [of, grid.points, wp.vec3(*grid.corner.tolist()), grid.voxel, ratios, wp.vec3i(*low), self._sums, prior]
        kernel_cache.launch(_find_texels, len(texels), given, [texels], device)
        return texels.numpy().reshape(-1, of.node_count, 4)


def _need_of(grid, of):
    """Return the least number of nodes per strand of `_Strands`."""
    points = grid.points[of.first_point : of.first_point + of.strand_count * of.point_count]
    some = points.reshape((of.strand_count, of.point_count))[:: -(-of.strand_count // _SAMPLED)].numpy()
    length = float(np.linalg.norm(np.diff(some, axis=1), axis=-1).sum(axis=1).mean())
    return max(math.ceil(min(length / (_LONGEST * grid.voxel), _MOST_NODES)), _LEAST_OF_STRAND)


def _counts(grid, systems, needs):
    """Return {index: nodes per strand} of the systems that have nodes; needs: {index: least number}.

    Systems that need few nodes in all come first, and the other nodes are shared in proportion, in any order of
    systems.
    """
    width = int(light_texels.sides_of(grid.shape)[0])
    greatest, total, chosen = min(light_texels.MOST_OF_STRAND, width), 0, []
    for index in sorted(needs, key=lambda index: needs[index] * systems[index].strand_count):
        needed = needs[index] * systems[index].strand_count
        if needs[index] <= greatest and total + needed <= _MOST_NODES:
            chosen.append(index)
            total += needed
    counts = {index: min(_MOST_NODES * needs[index] // total, greatest) for index in chosen}
    # Whole strands fill rows of texels.
    return {index: max(width // -(-width // count), needs[index]) for index, count in counts.items()}
