# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides: weighted means of guides' offsets  ([Report12] section 2.4, Eq. 10).

With weights w_j that add up to one, o_j,i the offsets of guide j (Eq. 7) and R_j what turns the surface at its root
into the surface at the strand's, the strand is p'_0 = q and

    p'_i = p'_(i-1) + λ_i m_i,    m_i = sum_j w_j R_j o_j,i,    l_i = sum_j w_j |o_j,i|,    λ_i = l_i / |m_i|

Eq. 10 is λ_i = 1, which makes a strand shorter than its guides wherever they disagree, to nothing where they oppose
each other. With λ_i as above each segment is as long as its guides' are on average. Weights do not depend on the point
(guide_weights.py): `interpolate` is what combing repeats.

R_j is the least rotation that takes the guide's normal to the strand's: it needs no UV map and is continuous wherever
normals are. With a frame F (tangent, bitangent, normal) at either root it is F_strand Z F_guide^T, Z being a turn about
the normal. So guides are put into their frames once, a neighbour costs five multiplications a point instead of nine,
and the strand's frame is applied to the sum.
"""

import warp as wp

from . import cores
from .cores import Rows
from .guide_weights import frame
from .lane_interpolation import CANCELLED, LONGEST, by_lanes, framed_offset

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BLOCK = 40  # segments that one vector holds on the processor: a strand of 41 points in one go
block = wp.types.vector(length=BLOCK, dtype=float)


def interpolate(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0):
    """(S, P) vec3 [m]: strands at roots (S,) [m] with unit normals (S,) that follow guides (G, P) [m], normals (G,).

    keep_length: how much of the way from Eq. 10 to segments as long as the guides' on average, 0 to 1.
    """
    by = by_strands if roots.device.is_cpu else by_lanes
    return by(roots, normals, guide_points, guide_normals, guide_weights, keep_length)


def by_strands(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0):
    """What `interpolate` returns, a strand at a time: the processor's way."""
    guide_count, point_count = guide_points.shape
    blocks = wp.empty((guide_count, -(-(point_count - 1) // BLOCK), 4), dtype=block, device=roots.device)
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
            keep_length,
        ],
        outputs=[points],
        device=roots.device,
    )
    return points


@wp.func
def _stretch(x: float, y: float, z: float, length: float, keep_length: float):
    """λ_i of a mean offset, or what part of it is wanted."""
    found = wp.max(wp.sqrt(x * x + y * y + z * z), wp.max(CANCELLED * length, 1.0e-30))
    stretch = 1.0 + keep_length * (length / found - 1.0)
    return wp.where(found < LONGEST, stretch, 1.0)


@wp.kernel
def _blocks_of_offsets(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_blocks: wp.array3d[block],
):
    guide, part = wp.tid()
    x = block(0.0)
    y = block(0.0)
    z = block(0.0)
    lengths = block(0.0)
    for i in range(BLOCK):
        offset = framed_offset(guide_points, guide, 1 + BLOCK * part + i, guide_normals[guide])
        x[i] = offset[0]
        y[i] = offset[1]
        z[i] = offset[2]
        lengths[i] = offset[3]
    out_blocks[guide, part, 0] = x
    out_blocks[guide, part, 1] = y
    out_blocks[guide, part, 2] = z
    out_blocks[guide, part, 3] = lengths


@wp.kernel
def _strands(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    blocks: wp.array3d[block],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    keep_length: float,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    root = roots[strand]
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    row = out_points[strand]
    row[0] = root
    along = wp.vec3()
    for part in range(blocks.shape[1]):
        # A block of segments at once, coordinate by coordinate: that is what fills vector registers.
        x = block(0.0)
        y = block(0.0)
        z = block(0.0)
        lengths = block(0.0)
        for slot in range(indices.shape[1]):
            weight = weights[strand, slot]
            if weight > 0.0:
                guide = indices[strand, slot]
                cosine = weight * turns[strand, slot][0]
                sine = weight * turns[strand, slot][1]
                guide_x = blocks[guide, part, 0]
                guide_y = blocks[guide, part, 1]
                x += cosine * guide_x - sine * guide_y
                y += sine * guide_x + cosine * guide_y
                z += weight * blocks[guide, part, 2]
                lengths += weight * blocks[guide, part, 3]
        stretch = block(0.0)
        for i in range(wp.static(BLOCK)):
            stretch[i] = _stretch(x[i], y[i], z[i], lengths[i], keep_length)
        x = wp.cw_mul(stretch, x)
        y = wp.cw_mul(stretch, y)
        z = wp.cw_mul(stretch, z)
        # Out of the strand's frame, again a block at once: point by point it would take as long as all sums.
        out_x = tangent[0] * x + bitangent[0] * y + normal[0] * z
        out_y = tangent[1] * x + bitangent[1] * y + normal[1] * z
        out_z = tangent[2] * x + bitangent[2] * y + normal[2] * z
        first = 1 + BLOCK * part
        for i in range(wp.min(BLOCK, row.shape[0] - first)):
            along += wp.vec3(out_x[i], out_y[i], out_z[i])
            row[first + i] = root + along  # Eq. 10
