# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides: weighted means of guides' offsets  ([Report12] section 2.4, Eq. 10).

With weights w_j that sum to one, o_j,i the offsets of guide j (Eq. 7) and R_j the rotation from the surface at its root
to the surface at the strand's root, the strand is p'_0 = q and

    p'_i = p'_(i-1) + λ_i m_i,    m_i = sum_j w_j R_j o_j,i,    l_i = sum_j w_j |o_j,i|,    λ_i = l_i / |m_i|

Eq. 10 is λ_i = 1, which makes a strand shorter than its guides if they diverge, down to zero if they are opposite.
With λ_i as above each segment has the average length of its guides' segments. Weights do not depend on the point
(guide_weights.py): combing repeats only `interpolate`.

R_j is the least rotation from the guide's normal to the strand's normal: it needs no UV map and is continuous wherever
normals are. With a frame F (tangent, bitangent, normal) at either root it is F_strand Z F_guide^T, Z being a rotation
about the normal. So guides are transformed to their frames once, a neighbor costs five multiplications per point
instead of nine, and the strand's frame is applied to the sum.

Beyond the outermost guides, or on a rough surface, the normal n of a strand differs from the normals of its guides. If
the strand turned by this difference, 5° would move the tips of hair of 38 cm by 3 cm. So a strand turns relative to its
guides only as far as no point moves by more than SPREAD of the mean distance of its guides: the normal of its frame is
n, moved toward the mean normal of its guides until the chord between them is SPREAD (Σ w_j |g_j - q|) / (Σ w_j L_j),
with guides' roots g_j and lengths L_j. Hair that is short beside the distance of its guides turns with the surface, and
so does hair around edges and on thin sheets, where the normals are more than 60° apart (guide_sum.strand).

Strands of gathered guides move from p'_i, which keeps the offset of their root from its guides, to the mean of their
guides' points, and reach it at the tie:

    p''_i = (1 - s_i) p'_i + s_i sum_j w_j g_j,i,    s_i = sum_j w_j smoothstep(i / (t_j (P - 1)))

with t_j the fraction of a guide's points up to its tie. Behind the tie a strand is within the hull of its guides, so
within their lock. A mean is shorter than its guides where these diverge; in a lock they do not.

interpolation.cpp computes eight segments of a strand at once, in vector registers of a processor (Clang's vectors,
which Warp compiles for the processor that it runs on: AVX, NEON) or in neighboring threads of a GPU. Sums over all
guides stay in registers, segments are added up to points, and a strand is written once. The equations are in
guide_sum.strand, which the interpolating shader includes too.
"""

from collections.abc import Callable

import warp as wp

from ..geometry.search.hash_grid import LIMIT
from ..kernels import chosen_rows, native_code, parallel
from ..kernels.checks import require_count
from ..kernels.chosen_rows import chosen_at
from ..kernels.parallel import Rows
from .guide_weights import ChosenStrands, GuideWeights, frame
from .hair_binding import SPREAD

wp.set_module_options({"enable_backward": False})

SEGMENTS = 8  # computed at once


def interpolate(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    guide_weights: GuideWeights,
    keep_length: float = 1.0,
    out: wp.array2d[wp.vec3] | None = None,
    under_way: Callable[[], None] | None = None,
    chosen: ChosenStrands | None = None,
    tie_fractions: wp.array[float] | None = None,
) -> wp.array2d[wp.vec3]:
    """Return (S, P) vec3 [m]: strands at roots (S,) [m] with unit normals (S,), for guides (G, P) [m], normals (G,).

    keep_length: blend from Eq. 10 (0) to segments with the average length of the guides' segments (1); out: array to
    fill and return, None for a new one; under_way: on the CPU, as in `parallel.launch`; chosen: strands to compute, in
    the order of the results and of the weights, which `limited` returns for the same strands, None for all;
    tie_fractions: (G,) in [0, 1], the fraction of each guide's points up to its tie, 0 for guides that are not
    gathered, None if no guide is gathered. Raises `HairError` if counts do not match.
    """
    row_count = len(roots) if chosen is None else len(chosen.strands)
    require_count("normals", len(normals), len(roots))
    require_count("guide normals", len(guide_normals), len(guide_points))
    require_count("guides", len(guide_points), guide_weights.guide_count)
    if tie_fractions is None:
        tie_fractions = wp.zeros(len(guide_points), dtype=float, device=roots.device)
    require_count("ties of guides", len(tie_fractions), len(guide_points))
    require_count("guide weights", len(guide_weights.weights), row_count)
    for array in (guide_weights.indices, guide_weights.turns):
        require_count("guide weights", len(array), len(roots))
    for array in (guide_weights.weights, guide_weights.turns):
        require_count("guide weights of a strand", array.shape[1], guide_weights.indices.shape[1])
    if guide_weights.indices.shape[1] > LIMIT:
        raise ValueError(f"at most {LIMIT} guides a strand, not {guide_weights.indices.shape[1]}")
    if out is not None:
        require_count("strands to fill", len(out), row_count)
        require_count("points to fill", out.shape[1], guide_points.shape[1])
    guide_count, point_count = guide_points.shape
    group_count = -(-(point_count - 1) // SEGMENTS)
    on_cpu = wp.get_device(roots.device).is_cpu
    offsets = wp.empty((guide_count, group_count, 4 * SEGMENTS), dtype=float, device=roots.device)
    guide_rows = wp.empty((guide_count, 8), dtype=float, device=roots.device)
    guides = None if chosen is None else chosen.guides
    chosen_rows.launch(_put_offsets, [guide_points, guide_normals, tie_fractions], [offsets, guide_rows], guides)
    threads = 1 if on_cpu else SEGMENTS
    points = parallel.empty_vectors((row_count, point_count), roots.device) if out is None else out
    strands, of_strand = chosen_rows.arguments(None if chosen is None else chosen.strands, roots.device)
    parallel.launch(
        _put_strands,
        row_count,
        inputs=[
            strands,
            of_strand(roots),
            of_strand(normals),
            guide_points,
            offsets,
            guide_rows,
            of_strand(guide_weights.indices),
            Rows(guide_weights.weights),
            of_strand(guide_weights.turns),
            SPREAD,
            keep_length,
            threads,
        ],
        outputs=[points],
        device=roots.device,
        under_way=under_way,
        threads_per_row=threads,
    )
    return points


@wp.func_native(native_code.body(__file__, "interpolation.cpp", WIDTH=SEGMENTS, SEGMENTS=SEGMENTS, SLOT_LIMIT=LIMIT))
def _sum_guides(
    strand: int,
    out_row: int,
    root: wp.vec3,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    guide_points: wp.array2d[wp.vec3],
    offsets: wp.array3d[float],
    guide_rows: wp.array2d[float],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    spread: float,
    keep_length: float,
    out_points: wp.array2d[wp.vec3],
): ...


@wp.kernel
def _put_strands(
    chosen: wp.array[int],
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_points: wp.array2d[wp.vec3],
    offsets: wp.array3d[float],
    guide_rows: wp.array2d[float],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    spread: float,
    keep_length: float,
    threads: int,  # per strand
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    row = wp.tid() / threads
    strand = chosen_at(chosen, row)
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    _sum_guides(
        strand,
        row,
        roots[strand],
        tangent,
        bitangent,
        normal,
        guide_points,
        offsets,
        guide_rows,
        indices,
        weights,
        turns,
        spread,
        keep_length,
        out_points,
    )


@wp.func_native(native_code.body(__file__, "guide_offsets.cpp", WIDTH=SEGMENTS, SEGMENTS=SEGMENTS))
def _frame_segments(
    guide: int,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    guide_points: wp.array2d[wp.vec3],
    out_offsets: wp.array3d[float],
) -> float: ...


@wp.kernel
def _put_offsets(
    chosen: wp.array[int],
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    tie_fractions: wp.array[float],
    # outputs
    out_offsets: wp.array3d[float],
    out_rows: wp.array2d[float],
):
    guide = chosen_at(chosen, wp.tid())
    tangent, bitangent = frame(guide_normals[guide])
    length = _frame_segments(guide, tangent, bitangent, guide_normals[guide], guide_points, out_offsets)
    for axis in range(3):
        out_rows[guide, axis] = guide_normals[guide][axis]
        out_rows[guide, 3 + axis] = guide_points[guide, 0][axis]
    out_rows[guide, 6] = length
    points_up_to_tie = tie_fractions[guide] * float(guide_points.shape[1] - 1)
    out_rows[guide, 7] = wp.where(points_up_to_tie > 0.0, 1.0 / points_up_to_tie, 0.0)
