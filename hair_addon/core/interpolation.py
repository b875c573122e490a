# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides: Gaussian-weighted means of guides' offsets  ([Report12] section 2.4, Eq. 8-10).

Weights do not depend on the point, so the recursion of Eq. 10 is a sum: p'_i = q + sum_j w_j R_j (P_j,i - P_j,0), where
R_j turns the surface at guide j's root into the surface at the strand's. `find_guides` searches and weighs, which
depends on roots alone; `interpolate` is what combing repeats.

R_j is the least rotation that takes the guide's normal to the strand's: it needs no UV map and is continuous wherever
normals are. With a frame F (tangent, bitangent, normal) at either root it is F_strand Z F_guide^T, Z being a turn about
the normal. So guides are put into their frames once, a neighbour costs five multiplications a point instead of nine,
and the strand's frame is applied to the sum.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from . import cores, hash_grid
from .cores import Rows

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BLOCK = 16  # points that one vector holds on the processor
block = wp.types.vector(length=BLOCK, dtype=float)

SHARE = 4  # points of one strand that a GPU's thread makes
share = wp.types.vector(length=SHARE, dtype=float)


@dataclass(frozen=True)
class GuideWeights:
    """The guides that each strand follows, nearest first: (S, k) arrays on one device.

    indices int32, -1 in unused slots; weights float32, adding up to one in every row, 0 in unused slots; turns vec2:
    cosine and sine of the angle about the normal from the guide's frame to the strand's.
    """

    indices: "wp.array2d[int]"
    weights: "wp.array2d[float]"
    turns: "wp.array2d[wp.vec2]"


@dataclass(frozen=True)
class Reach:
    """The strands that follow each guide, as compressed rows: guide g's are strands[starts[g]:starts[g + 1]]."""

    starts: np.ndarray  # (G+1,) int64
    strands: np.ndarray  # int32

    def of(self, guides):
        """Indices, rising, of the strands that follow any of some guides."""
        is_reached = np.zeros(int(self.strands.max(initial=-1)) + 1, bool)
        for guide in guides:
            is_reached[self.strands[self.starts[guide] : self.starts[guide + 1]]] = True
        return np.flatnonzero(is_reached)


def reach(guide_weights, guide_count):
    """The `Reach` of guides, from the `GuideWeights` of the strands that follow them."""
    indices = guide_weights.indices.numpy()
    strands, slots = np.nonzero(indices >= 0)
    guides = indices[strands, slots]
    order = np.argsort(guides, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(guides, minlength=guide_count))])
    return Reach(starts, strands[order].astype(np.int32))


def rows(array, chosen):
    """Some rows of a Warp array, in an array of their own; chosen: int32 Warp array on its device."""
    return wp.indexedarray(array, [chosen, *[None] * (array.ndim - 1)]).contiguous()


def automatic_influence_distance(guide_roots):
    """Twice the mean distance [m] from a guide's root to the next one's; guide_roots (G,) vec3 [m].

    Any root then has about eleven evenly placed guides in reach. A lone guide is followed from anywhere: 1 m will do.
    """
    extent = float(np.linalg.norm(np.ptp(guide_roots.numpy(), axis=0)))
    if extent == 0.0:
        return 1.0
    _, distances = hash_grid.neighbours(guide_roots, guide_roots, 2.0 * extent, 2)
    return 2.0 * float(distances.numpy()[:, 1].mean())


def find_guides(roots, normals, guide_roots, guide_normals, influence_distance, neighbour_limit):
    """`GuideWeights` of strands at roots (S,) [m] with unit normals (S,), for guides (G,) likewise; all vec3 arrays.

    A guide counts when its root is nearer than the influence distance [m]; of those, the `neighbour_limit` nearest. A
    root with none in reach follows the nearest one alone.
    """
    indices, distances = hash_grid.neighbours(guide_roots, roots, influence_distance, neighbour_limit)
    weights = wp.empty_like(distances)
    turns = wp.empty(indices.shape, dtype=wp.vec2, device=roots.device)
    cores.launch(
        _weigh,
        len(roots),
        inputs=[Rows(indices), Rows(distances), Rows(normals), guide_normals, influence_distance],
        outputs=[weights, turns],
        device=roots.device,
    )
    return GuideWeights(indices, weights, turns)


def interpolate(roots, normals, guide_points, guide_normals, guide_weights):
    """(S, P) vec3 [m]: strands at roots (S,) [m] with unit normals (S,) that follow guides (G, P) [m], normals (G,)."""
    by = by_strands if roots.device.is_cpu else by_points
    return by(roots, normals, guide_points, guide_normals, guide_weights)


def by_strands(roots, normals, guide_points, guide_normals, guide_weights):
    """What `interpolate` returns, a strand at a time: the processor's way."""
    guide_count, point_count = guide_points.shape
    blocks = wp.empty((guide_count, -(-point_count // BLOCK), 3), dtype=block, device=roots.device)
    wp.launch(
        _blocks_of_offsets,
        dim=blocks.shape[:2],
        inputs=[guide_points, guide_normals],
        outputs=[blocks],
        device=roots.device,
    )
    points = cores.empty_vectors((len(roots), point_count), roots.device)
    cores.launch(
        _strands,
        len(roots),
        inputs=[
            Rows(roots),
            Rows(normals),
            blocks,
            Rows(guide_weights.indices),
            Rows(guide_weights.weights),
            Rows(guide_weights.turns),
        ],
        outputs=[points],
        device=roots.device,
    )
    return points


def by_points(roots, normals, guide_points, guide_normals, guide_weights):
    """What `interpolate` returns, neighbouring points by neighbouring threads: the GPU's way, six times as fast there.

    So they read and write memory side by side; each makes a few points far apart, for which it reads weights once.
    """
    point_count = guide_points.shape[1]
    offsets = wp.empty_like(guide_points)
    wp.launch(
        _framed_offsets,
        dim=offsets.shape,
        inputs=[guide_points, guide_normals],
        outputs=[offsets],
        device=roots.device,
    )
    points = wp.empty((len(roots), point_count), dtype=wp.vec3, device=roots.device)
    lane_count = -(-point_count // SHARE)
    wp.launch(
        _points,
        dim=(len(roots), lane_count),
        inputs=[
            roots,
            normals,
            offsets,
            guide_weights.indices,
            guide_weights.weights,
            guide_weights.turns,
            lane_count,
        ],
        outputs=[points],
        device=roots.device,
    )
    return points


@wp.func
def _frame(normal: wp.vec3):
    """Tangent and bitangent of a unit normal, without a branch or a pole [Duff17]."""
    sign = wp.where(normal[2] >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + normal[2])
    b = normal[0] * normal[1] * a
    tangent = wp.vec3(1.0 + sign * normal[0] * normal[0] * a, sign * b, -sign * normal[0])
    return tangent, wp.vec3(b, sign + normal[1] * normal[1] * a, -normal[1])


@wp.func
def _turn(guide_normal: wp.vec3, normal: wp.vec3):
    """Cosine and sine of Z: where the least rotation from one normal to the other leaves the guide's tangent."""
    guide_tangent, _guide_bitangent = _frame(guide_normal)
    tangent, bitangent = _frame(normal)
    # For t across a: R t = t - (t·b) (a + b) / (1 + a·b). Opposite normals have no least rotation: any will do.
    lean = wp.dot(guide_tangent, normal) / wp.max(1.0 + wp.dot(guide_normal, normal), 1.0e-6)
    turned = guide_tangent - lean * (guide_normal + normal)
    return wp.normalize(wp.vec2(wp.dot(tangent, turned), wp.dot(bitangent, turned)))


@wp.kernel
def _weigh(
    indices: wp.array2d[int],
    distances: wp.array2d[float],
    normals: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    influence_distance: float,
    # outputs
    out_weights: wp.array2d[float],
    out_turns: wp.array2d[wp.vec2],
):
    strand = wp.tid()
    sigma = 0.5 * influence_distance  # Eq. 9
    nearest = distances[strand, 0]
    total = float(0.0)
    for slot in range(indices.shape[1]):
        weight = float(0.0)
        turn = wp.vec2(1.0, 0.0)
        guide = indices[strand, slot]
        if guide >= 0:
            distance = distances[strand, slot]
            # Relative to the nearest guide's, which cancels in Eq. 10: no weight of a far root is lost to rounding.
            weight = wp.exp((nearest * nearest - distance * distance) / (2.0 * sigma * sigma))
            turn = _turn(guide_normals[guide], normals[strand])
        out_weights[strand, slot] = weight
        out_turns[strand, slot] = turn
        total += weight
    for slot in range(indices.shape[1]):
        out_weights[strand, slot] = out_weights[strand, slot] / total


@wp.kernel
def _blocks_of_offsets(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_blocks: wp.array3d[block],
):
    guide, part = wp.tid()
    normal = guide_normals[guide]
    tangent, bitangent = _frame(normal)
    x = block(0.0)
    y = block(0.0)
    z = block(0.0)
    first = BLOCK * part
    for point in range(wp.min(BLOCK, guide_points.shape[1] - first)):
        offset = guide_points[guide, first + point] - guide_points[guide, 0]  # the sum of Eq. 7's offsets
        x[point] = wp.dot(tangent, offset)
        y[point] = wp.dot(bitangent, offset)
        z[point] = wp.dot(normal, offset)
    out_blocks[guide, part, 0] = x
    out_blocks[guide, part, 1] = y
    out_blocks[guide, part, 2] = z


@wp.kernel
def _strands(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    blocks: wp.array3d[block],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    root = roots[strand]
    normal = normals[strand]
    tangent, bitangent = _frame(normal)
    row = out_points[strand]
    for part in range(blocks.shape[1]):
        # A block of points at once, coordinate by coordinate: that is what fills vector registers.
        x = block(0.0)
        y = block(0.0)
        z = block(0.0)
        for slot in range(indices.shape[1]):
            guide = indices[strand, slot]
            if guide >= 0:
                weight = weights[strand, slot]
                cosine = weight * turns[strand, slot][0]
                sine = weight * turns[strand, slot][1]
                guide_x = blocks[guide, part, 0]
                guide_y = blocks[guide, part, 1]
                x += cosine * guide_x - sine * guide_y
                y += sine * guide_x + cosine * guide_y
                z += weight * blocks[guide, part, 2]
        first = BLOCK * part
        # Out of the strand's frame (Eq. 10), again a block at once: point by point it would take as long as all sums.
        out_x = block(root[0]) + tangent[0] * x + bitangent[0] * y + normal[0] * z
        out_y = block(root[1]) + tangent[1] * x + bitangent[1] * y + normal[1] * z
        out_z = block(root[2]) + tangent[2] * x + bitangent[2] * y + normal[2] * z
        for point in range(wp.min(BLOCK, row.shape[0] - first)):
            row[first + point] = wp.vec3(out_x[point], out_y[point], out_z[point])


@wp.kernel
def _framed_offsets(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_offsets: wp.array2d[wp.vec3],
):
    guide, point = wp.tid()
    normal = guide_normals[guide]
    tangent, bitangent = _frame(normal)
    offset = guide_points[guide, point] - guide_points[guide, 0]  # the sum of Eq. 7's offsets
    out_offsets[guide, point] = wp.vec3(wp.dot(tangent, offset), wp.dot(bitangent, offset), wp.dot(normal, offset))


@wp.kernel
def _points(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    offsets: wp.array2d[wp.vec3],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    lane_count: int,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand, lane = wp.tid()
    last = out_points.shape[1] - 1
    x = share(0.0)
    y = share(0.0)
    z = share(0.0)
    for slot in range(indices.shape[1]):
        guide = indices[strand, slot]
        if guide >= 0:
            weight = weights[strand, slot]
            cosine = weight * turns[strand, slot][0]
            sine = weight * turns[strand, slot][1]
            for i in range(wp.static(SHARE)):  # unrolled, so that sums stay in registers
                offset = offsets[guide, wp.min(lane + i * lane_count, last)]
                x[i] += cosine * offset[0] - sine * offset[1]
                y[i] += sine * offset[0] + cosine * offset[1]
                z[i] += weight * offset[2]
    root = roots[strand]
    normal = normals[strand]
    tangent, bitangent = _frame(normal)
    for i in range(wp.static(SHARE)):
        point = lane + i * lane_count
        if point <= last:
            out_points[strand, point] = root + x[i] * tangent + y[i] * bitangent + z[i] * normal  # Eq. 10
