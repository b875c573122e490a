# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides between which interpolation reproduces given strands: linear least squares.

With the weights w of a binding and guides' arms a_j (points minus root) in the frames of their roots, interpolation
without preserved lengths gives strand s the arms sum_j w_sj Z_sj a_j in its own frame, Z_sj being the rotation about
the normal (interpolation.py). For complex numbers x + iy that rotation is a factor e^(i phi), so x + iy and z are
sparse linear least squares with one matrix each for all points, solved by the normal equations. Each guide is damped
toward its present shape with its own weight, so that the steps can be repeated although interpolation is not linear,
and guides with few strands are stable. Strands have the frames of short hair here: the limited turns of long strands
(interpolation.py) would make errors of hair that is three times as long as the radius of its sphere only 1 % smaller.
"""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows
from .guide_weights import GuideWeights, frame
from .hair_binding import HairBinding

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_HOLD = 1.0  # damping, as a factor of a guide's own weight in the normal equations


def fitted(
    binding: HairBinding,
    guide_weights: GuideWeights,
    arms: np.ndarray,
    guide_arms: np.ndarray,
    chosen: np.ndarray,
    stretches: np.ndarray | None = None,
) -> np.ndarray:
    """Return (G, P, 3) float32 [m]: arms of guides whose interpolation best fits strands.

    binding: of S strands to G guides, on the CPU; guide_weights: of these strands, from `guide_weights.limited`; arms
    (S, P, 3) float32 [m]: points minus root of the strands; guide_arms (G, P, 3) float32 [m]: present arms of the
    guides; chosen: (M,) indices of the strands to fit; stretches (S,): factors by which preserved lengths lengthen
    strands, None for no factors.
    """
    require_count("strands", len(arms), len(binding.positions))
    require_count("guides", len(guide_arms), guide_weights.guide_count)
    indices = guide_weights.indices.numpy()[chosen].astype(np.int64)
    weights = np.where(indices >= 0, guide_weights.weights.numpy()[chosen], 0.0).astype(np.float64)
    if stretches is not None:
        require_count("stretches", len(stretches), len(arms))
        weights *= stretches[chosen][:, None]
    turns = guide_weights.turns.numpy()[chosen].astype(np.float64)
    indices = np.where(indices >= 0, indices, 0)
    own = _in_frames(np.ascontiguousarray(arms[chosen]), binding.normals.numpy()[chosen]).astype(np.float64)
    before = _in_frames(guide_arms, binding.guide_normals.numpy()).astype(np.float64)
    level = _solved(indices, weights * (turns[..., 0] + 1j * turns[..., 1]), _complex(own), _complex(before))
    upright = _solved(indices, weights, own[..., 2], before[..., 2])
    made = np.stack([level.real, level.imag, upright], axis=2).astype(np.float32)
    return _out_of_frames(made, binding.guide_normals.numpy())


def _complex(arms):
    return arms[..., 0] + 1j * arms[..., 1]


def _solved(indices, factors, wanted, before):
    """Return (G, P): least squares of sum_k factors_sk x_(indices_sk) = wanted (M, P), damped to `before` (G, P)."""
    count, slot_count = len(before), indices.shape[1]
    matrix = np.zeros(count * count, factors.dtype)
    right = np.zeros(before.shape, factors.dtype)
    for slot in range(slot_count):
        for other in range(slot_count):
            places = indices[:, slot] * count + indices[:, other]
            matrix += _summed(places, factors[:, slot].conj() * factors[:, other], count * count)
        order = np.argsort(indices[:, slot], kind="stable")
        rows, starts = np.unique(indices[order, slot], return_index=True)
        terms = factors[order, slot, None].conj() * wanted[order]
        right[rows] += np.add.reduceat(terms, starts, axis=0)
    matrix = matrix.reshape(count, count)
    diagonal = matrix.diagonal().real
    hold = _HOLD * diagonal + 1e-9 * max(float(diagonal.max()), 1e-30)
    matrix[np.arange(count), np.arange(count)] += hold
    return np.linalg.solve(matrix, right + hold[:, None] * before)


def _summed(places, values, count):
    """Return (count,): sums of values (M,), real or complex, by index."""
    if np.iscomplexobj(values):
        return np.bincount(places, values.real, count) + 1j * np.bincount(places, values.imag, count)
    return np.bincount(places, values, count)


def _in_frames(arms, normals):
    """Return (N, P, 3) float32: arms in the frames of unit normals (N, 3)."""
    return _turned(arms, normals, _to_frames)


def _out_of_frames(arms, normals):
    """Return (N, P, 3) float32: arms in scene axes; arms: in the frames of unit normals (N, 3)."""
    return _turned(arms, normals, _from_frames)


def _turned(arms, normals, kernel):
    given = wp.array(np.ascontiguousarray(arms, np.float32), dtype=wp.vec3, device="cpu", copy=False)
    ups = wp.array(np.ascontiguousarray(normals, np.float32), dtype=wp.vec3, device="cpu", copy=False)
    made = parallel.empty_vectors(given.shape, "cpu")
    parallel.launch(kernel, len(given), inputs=[Rows(given), Rows(ups)], outputs=[made], device="cpu", least_rows=256)
    return made.numpy()


@wp.kernel
def _to_frames(
    arms: wp.array2d[wp.vec3],
    normals: wp.array[wp.vec3],
    # outputs
    out_arms: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    for point in range(arms.shape[1]):
        arm = arms[strand, point]
        out_arms[strand, point] = wp.vec3(wp.dot(tangent, arm), wp.dot(bitangent, arm), wp.dot(normal, arm))


@wp.kernel
def _from_frames(
    arms: wp.array2d[wp.vec3],
    normals: wp.array[wp.vec3],
    # outputs
    out_arms: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    for point in range(arms.shape[1]):
        arm = arms[strand, point]
        out_arms[strand, point] = arm[0] * tangent + arm[1] * bitangent + arm[2] * normal
