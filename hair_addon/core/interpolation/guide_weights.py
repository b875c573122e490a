# SPDX-License-Identifier: GPL-3.0-or-later
"""Neighboring guides of each strand and their weights  ([Report12] section 2.4, Eq. 8-9).

A strand with its root at q blends the k guides nearest to it. With r_j the distance from q to guide j's root and r'
the distance to the nearest excluded guide, the weight is the Gaussian of Eq. 9, reduced to zero by a second factor:

    w_j = exp(-r_j² / 2σ²) (1 - r_j² / ρ²)²    where r_j < ρ,    ρ = min(d, r'),    σ = d / 2

Both r_j and r' are continuous in q, and so are the weights: a guide enters or leaves at ρ, where its weight is zero,
whether it passes the influence distance d or swaps ranks with another guide. Automatic: d = r', the guide spacing
around each root. If no guide is within d / STRETCH, d is STRETCH times the distance to the nearest one.

`limited` then reduces the weights of guides whose shape differs from the nearest one's. It depends on the guides'
shapes and not on roots, so it needs no search, and combing repeats it.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import warp as wp

from ..geometry.search import hash_grid
from ..kernels import chosen_rows, kernel_cache, parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.chosen_rows import chosen_at
from ..kernels.parallel import Rows
from . import cpu_weights, part_lines, sharp_edges

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

STRETCH = 1.25
EVERYWHERE = 1e18  # [m]: an unlimited search distance
SURPLUS = 3  # factor of the number of candidates near part lines, which may separate some of them

UNLIMITED = 200.0  # in logarithms of lengths: more than any two floats differ by
FADE = math.radians(30.0)  # of the angle limit, over which a guide's weight fades


@dataclass(frozen=True)
class Candidates:
    """The guides nearest to each strand, nearest first, and the first excluded one: (S, k + 1) arrays on one device.

    indices int32, -1 in unused slots; ways float32 [m]: lengths of the paths to these guides, straight or around part
    lines and sharp edges, inf in unused slots; guide_count: number of guides, above all indices.
    """

    indices: "wp.array2d[int]"
    ways: "wp.array2d[float]"
    guide_count: int


@dataclass(frozen=True)
class GuideWeights:
    """The guides that each strand follows, nearest first: (S, k) arrays on one device.

    indices int32, -1 in unused slots; weights float32, adding up to one in every row, 0 in unused slots; turns vec2:
    cosine and sine of the angle about the normal from the guide's frame to the strand's; guide_count: number of guides,
    above all indices.
    """

    indices: "wp.array2d[int]"
    weights: "wp.array2d[float]"
    turns: "wp.array2d[wp.vec2]"
    guide_count: int


@dataclass(frozen=True)
class Limits:
    """Limits of the difference between a guide and the nearest one.

    angle [rad]: between their directions relative to the surface; pi: no limit. length: ratio of their lengths.
    """

    angle: float = math.pi
    length: float = math.inf

    @property
    def fading(self) -> tuple[float, float, float, float]:
        """(cosine without weight, 1 / range of cosines over which guides fade, and both for logarithms of lengths)."""
        none, all_of_it = -3.0, -2.0
        if self.angle < math.pi:
            none, all_of_it = math.cos(self.angle), math.cos(max(self.angle - FADE, 0.0))
        length_limit = min(math.log(self.length), UNLIMITED)
        return none, 1.0 / max(all_of_it - none, 1e-6), length_limit, 1.0 / max(0.5 * length_limit, 1e-6)


@dataclass(frozen=True)
class Reach:
    """The strands that follow each guide, as compressed rows: strands[starts[g]:starts[g + 1]] follow guide g."""

    starts: np.ndarray  # (G+1,) int64
    strands: np.ndarray  # int32

    def of(self, guides: np.ndarray) -> np.ndarray:
        """Return the ascending indices of the strands that follow any of some guides."""
        if len(guides) == len(self.starts) - 1:
            reached = self.strands
        else:
            # For few guides the time depends on their strands, not on all strands.
            rows = [self.strands[self.starts[guide] : self.starts[guide + 1]] for guide in guides]
            reached = np.concatenate([self.strands[:0], *rows])
        is_reached = np.zeros(int(reached.max(initial=-1)) + 1, bool)
        is_reached[reached] = True
        return np.flatnonzero(is_reached)


def reach(guide_weights: GuideWeights, guide_count: int) -> Reach:
    """Return the `Reach` of guides, from the `GuideWeights` of the strands that follow them."""
    return reach_by(guide_weights.indices.numpy(), guide_count)


def reach_by(indices: np.ndarray, guide_count: int) -> Reach:
    """Return the `Reach` of guides or other owners; indices (S, k) int32: owners of each strand, -1 for none."""
    # Each pair of guide and strand is sorted as one number, which is four times as fast as sorting indices.
    pairs = (indices.astype(np.int64) << 32) | np.arange(len(indices))[:, None]
    pairs = np.sort(pairs[indices >= 0])
    starts = np.searchsorted(pairs, np.arange(guide_count + 1) << 32)
    return Reach(starts, pairs.astype(np.int32))


def rows(array: wp.array, chosen: wp.array[int]) -> wp.array:
    """Return a copy of some rows of a Warp array; chosen: int32 Warp array on its device."""
    return wp.indexedarray(array, [chosen, *[None] * (array.ndim - 1)]).contiguous()


@dataclass(frozen=True)
class ChosenStrands:
    """Indices int32 of some strands, and of the guides that they follow, on the strands' device."""

    strands: wp.array
    guides: wp.array


def chosen_strands(guide_weights: GuideWeights, chosen: np.ndarray) -> ChosenStrands:
    """Return the `ChosenStrands` with indices (M,). Raises `HairError` if an index is out of range."""
    require_indices("strands", chosen, len(guide_weights.indices))
    indices = guide_weights.indices
    strands = wp.array(np.asarray(chosen, np.int32), dtype=int, device=indices.device)
    its_guides = indices.numpy()[chosen] if indices.device.is_cpu else rows(indices, strands).numpy()
    is_followed = np.zeros(guide_weights.guide_count + 1, bool)
    is_followed[its_guides] = True  # index -1 stands for no guide
    guides = np.flatnonzero(is_followed[:-1]).astype(np.int32)
    return ChosenStrands(strands, wp.array(guides, dtype=int, device=indices.device))


def find_candidates(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_roots: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    neighbour_limit: int,
    *,
    regions: tuple[np.ndarray, np.ndarray] | None = None,
    lines: part_lines.PartLines | None = None,
) -> Candidates:
    """Find the `Candidates` of strands at roots (S,) [m] with unit normals (S,), among guides (G,); all vec3 arrays.

    neighbour_limit: k; regions: (S,) and (G,) int32, strands blend only guides of their own region, or of one other
    region if theirs has no guides; lines: `PartLines` that paths to guides must not cross.
    """
    require_count("normals", len(normals), len(roots))
    require_count("guide normals", len(guide_normals), len(guide_roots))
    candidates, ways = _nearest_guides(guide_roots, roots, neighbour_limit + 1, regions)
    if lines is not None:
        candidates, ways = _parted(lines, roots, normals, guide_roots, guide_normals, candidates, ways, regions)
    sharp_edges.go_around(normals, guide_normals, candidates, ways)
    return Candidates(candidates, ways, len(guide_roots))


def only_candidates(guides: np.ndarray, guide_count: int, neighbour_limit: int, device: wp.DeviceLike) -> Candidates:
    """Return the `Candidates` of strands that follow one guide each; guides: (S,) indices below guide_count.

    neighbour_limit: k.
    """
    require_indices("guides", guides, guide_count)
    indices = np.full((len(guides), neighbour_limit + 1), -1, np.int32)
    ways = np.full(indices.shape, np.inf, np.float32)
    indices[:, 0], ways[:, 0] = guides, 1.0  # a lone guide has a weight of one at any finite distance
    return Candidates(wp.array(indices, device=device), wp.array(ways, device=device), guide_count)


def weigh(
    candidates: Candidates,
    normals: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    influence_distance: float | None,
    neighbour_limit: int,
) -> GuideWeights:
    """Return the `GuideWeights` (S, k) for at least k + 1 `Candidates`; normals (S,), guide_normals (G,).

    influence_distance: d [m], None for automatic; neighbour_limit: k.
    """
    require_count("guide normals", len(guide_normals), candidates.guide_count)
    if not neighbour_limit < min(candidates.indices.shape[1], hash_grid.LIMIT + 1):
        raise ValueError(f"{neighbour_limit} guides a strand of {candidates.indices.shape[1]} candidates")
    device, strand_count = normals.device, len(normals)
    indices = wp.empty((strand_count, neighbour_limit), dtype=int, device=device)
    weights = wp.empty(indices.shape, dtype=float, device=device)
    turns = wp.empty(indices.shape, dtype=wp.vec2, device=device)
    frames = wp.empty((len(guide_normals), cpu_weights.NUMBERS), dtype=float, device=device)
    kernel_cache.launch(_frames, len(guide_normals), inputs=[guide_normals], outputs=[frames], device=device)
    parallel.launch(
        _weigh,
        strand_count,
        inputs=[
            Rows(candidates.indices),
            Rows(candidates.ways),
            Rows(normals),
            frames,
            influence_distance or 0.0,
        ],
        outputs=[indices, weights, turns],
        device=device,
    )
    return GuideWeights(indices, weights, turns, candidates.guide_count)


def _nearest_guides(guide_roots, roots, count, regions):
    """Return indices and distances (S, count) as `hash_grid.neighbours`, of guides in each root's own region."""
    if regions is None:
        return hash_grid.neighbours(guide_roots, roots, EVERYWHERE, count)
    strand_regions, guide_regions = regions
    require_count("regions of strands", len(strand_regions), len(roots))
    require_count("regions of guides", len(guide_regions), len(guide_roots))
    device = roots.device
    strays = np.flatnonzero(~np.isin(strand_regions, guide_regions))
    if len(strays):  # in a region without guides, use the region of the nearest guide
        found, _distances = hash_grid.neighbours(guide_roots, _some(roots, strays), EVERYWHERE, 1)
        strand_regions = strand_regions.copy()
        strand_regions[strays] = guide_regions[found.numpy()[:, 0]]
    indices = np.full((len(roots), count), -1, np.int32)
    distances = np.full((len(roots), count), np.inf, np.float32)
    for region in np.unique(strand_regions):
        own, its = np.flatnonzero(guide_regions == region), np.flatnonzero(strand_regions == region)
        found, apart = hash_grid.neighbours(_some(guide_roots, own), _some(roots, its), EVERYWHERE, count)
        found = found.numpy()
        indices[its] = np.where(found >= 0, own[found], -1)
        distances[its] = apart.numpy()
    return wp.array(indices, device=device), wp.array(distances, device=device)


def _parted(lines, roots, normals, guide_roots, guide_normals, candidates, ways, regions):
    """Return candidates and path lengths (S, k + 1) around part lines.

    Near a line the search finds more guides, to replace guides behind it. The last path length is at most the distance
    to a guide that the search did not find.
    """
    near = part_lines.near(lines, roots, ways)
    if not len(near):
        return candidates, ways
    count = candidates.shape[1]
    its_regions = None if regions is None else (regions[0][near], regions[1])
    its_roots = _some(roots, near)
    most = min(SURPLUS * count, hash_grid.LIMIT)
    found, lengths = _nearest_guides(guide_roots, its_roots, most, its_regions)
    unseen = lengths.numpy()[:, -1].copy()
    part_lines.go_around(lines, its_roots, _some(normals, near), guide_roots, guide_normals, found, lengths)
    lengths = lengths.numpy()[:, :count].copy()
    lengths[:, -1] = np.minimum(lengths[:, -1], unseen)
    candidates, ways = candidates.numpy().copy(), ways.numpy().copy()
    candidates[near], ways[near] = found.numpy()[:, :count], lengths
    return wp.array(candidates, device=roots.device), wp.array(ways, device=roots.device)


def _some(array, chosen):
    return rows(array, wp.array(chosen, dtype=int, device=array.device))


def limited(
    guide_weights: GuideWeights,
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    limits: Limits,
    chosen: ChosenStrands | None = None,
) -> GuideWeights:
    """Return `GuideWeights` without guides that differ too much from the nearest one; points (G, P) [m], normals (G,).

    A guide's weight fades over the last `FADE` of the angle limit, and from the square root of the length limit on.
    chosen: strands whose weights (M, k) are computed, None for all.
    """
    require_count("guides", len(guide_points), guide_weights.guide_count)
    require_count("guide normals", len(guide_normals), len(guide_points))
    device = guide_points.device
    shapes = wp.empty((len(guide_points), cpu_weights.NUMBERS), dtype=float, device=device)
    chosen_rows.launch(_shapes, [guide_points, guide_normals], [shapes], None if chosen is None else chosen.guides)
    row_count = len(guide_weights.weights) if chosen is None else len(chosen.strands)
    weights = wp.empty((row_count, guide_weights.weights.shape[1]), dtype=float, device=device)
    strands, of_strand = chosen_rows.arguments(None if chosen is None else chosen.strands, device)
    arrays = (guide_weights.indices, guide_weights.weights, guide_weights.turns)
    inputs = [strands, *map(of_strand, arrays), shapes, *limits.fading]
    parallel.launch(_limit, row_count, inputs, [weights], device)
    return replace(guide_weights, weights=weights)


@wp.func
def frame(normal: wp.vec3):
    """Tangent and bitangent of a unit normal, without a branch or a pole [Duff17]."""
    sign = wp.where(normal[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + normal[2])
    b = normal[0] * normal[1] * a
    tangent = wp.vec3(1.0 + sign * normal[0] * normal[0] * a, sign * b, -sign * normal[0])
    return tangent, wp.vec3(b, sign + normal[1] * normal[1] * a, -normal[1])


@wp.kernel
def _frames(
    normals: wp.array[wp.vec3],
    # outputs
    out_frames: wp.array2d[float],
):
    guide = wp.tid()
    normal = normals[guide]
    tangent, _bitangent = frame(normal)
    for axis in range(3):
        out_frames[guide, axis] = tangent[axis]
        out_frames[guide, 3 + axis] = normal[axis]
    out_frames[guide, 6] = 0.0
    out_frames[guide, 7] = 0.0


@wp.kernel
def _weigh(
    candidates: wp.array2d[int],
    ways: wp.array2d[float],
    normals: wp.array[wp.vec3],
    frames: wp.array2d[float],
    influence_distance: float,
    # outputs
    out_indices: wp.array2d[int],
    out_weights: wp.array2d[float],
    out_turns: wp.array2d[wp.vec2],
):
    strand = wp.tid()
    limit = out_indices.shape[1]
    nearest = ways[strand, 0]
    left_out = ways[strand, limit]
    distance = influence_distance
    if distance == 0.0:
        distance = left_out
        if left_out == wp.inf:
            # At most k guides: none is excluded, and the farthest is well within range.
            for slot in range(limit):
                if ways[strand, slot] < wp.inf:
                    distance = STRETCH * ways[strand, slot]
    distance = wp.max(distance, STRETCH * nearest)
    reach = wp.min(distance, left_out)
    sigma = wp.max(0.5 * distance, 1.0e-15)  # Eq. 9
    fall_off = 1.0 / (2.0 * sigma * sigma)
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    cpu_weights.weigh(
        strand,
        nearest,
        reach,
        fall_off,
        tangent,
        bitangent,
        normal,
        candidates,
        ways,
        frames,
        out_indices,
        out_weights,
        out_turns,
    )


@wp.kernel
def _shapes(
    chosen: wp.array[int],
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_shapes: wp.array2d[float],
):
    """Unit directions in the guide's frame, of its lower half and from root to tip, and the logarithm of its length."""
    guide = chosen_at(chosen, wp.tid())
    normal = guide_normals[guide]
    tangent, bitangent = frame(normal)
    root = guide_points[guide, 0]
    last = guide_points.shape[1] - 1
    cpu_weights.sum_points(guide, guide_points, out_shapes)
    lower = wp.vec3(out_shapes[guide, 0], out_shapes[guide, 1], out_shapes[guide, 2])
    length = out_shapes[guide, 6]
    tip = guide_points[guide, last] - root
    lower = wp.normalize(wp.vec3(wp.dot(tangent, lower), wp.dot(bitangent, lower), wp.dot(normal, lower)))
    tip = wp.normalize(wp.vec3(wp.dot(tangent, tip), wp.dot(bitangent, tip), wp.dot(normal, tip)))
    for axis in range(3):
        out_shapes[guide, axis] = lower[axis]
        out_shapes[guide, 3 + axis] = tip[axis]
    out_shapes[guide, 6] = wp.log(wp.clamp(length, 1.0e-30, 1.0e30))
    out_shapes[guide, 7] = 0.0


@wp.kernel
def _limit(
    chosen: wp.array[int],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    shapes: wp.array2d[float],
    cosine_none: float,
    per_cosine: float,
    length_limit: float,
    per_length: float,
    # outputs
    out_weights: wp.array2d[float],
):
    row = wp.tid()
    cpu_weights.limit(
        chosen_at(chosen, row),
        row,
        indices,
        weights,
        turns,
        shapes,
        cosine_none,
        per_cosine,
        length_limit,
        per_length,
        out_weights,
    )
