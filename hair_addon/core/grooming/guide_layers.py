# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of guides: combing stored as rotations and stretches of segments, with weights.

The base is a set of guides. Its segment i has a frame F_i, carried from the root's frame by least rotations along the
base. A layer has a turn C_i and a stretch s_i per segment, so that layers 1 to n with weights w make the segment

    t'_i = F_i C_1,i^w1 ... C_n,i^wn e_z,    l'_i = l_i exp(w1 s_1,i + ... + wn s_n,i).

The turns of a layer therefore follow the layers below, segment by segment, and a fraction of a turn keeps all lengths.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import geometry, grooming
from ..kernels.checks import require_count, require_indices

LEAST_WEIGHT = 0.01  # guides with a smaller weight cannot be recorded: their turns would be multiplied by a hundred
_TOLERANCE = 2e-6  # of a guide's extent: smaller differences are rounding


@dataclass(frozen=True)
class GuideLayers:
    """G guides with N points and L layers, from bottom to top.

    base (N, 3) float32; counts (G,): points of each guide; normals, tangents (G, 3): perpendicular unit axes of the
    frame at each root; turns (L, N, 4) float32: quaternion w, x, y, z of the segment that ends at a point, zero counts
    as no turn; stretches (L, N) float32: logarithm of its length ratio; weights (L, G) float32: of each layer and
    guide, at least 0. For `composed` and `recorded`, turns and stretches may also be tuples of L contiguous arrays, as
    in Blender's memory.
    """

    base: np.ndarray
    counts: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray
    turns: np.ndarray
    stretches: np.ndarray
    weights: np.ndarray

    def __post_init__(self) -> None:
        """Raise `HairError` if the arrays do not fit together."""
        guide_count, layer_count = len(self.counts), len(self.turns)
        require_count("points", int(np.sum(self.counts)), len(self.base))
        for values in (self.normals, self.tangents):
            require_count("axes of guides", len(values), guide_count)
        require_count("weights", self.weights.size, layer_count * guide_count)
        require_count("layers with stretches", len(self.stretches), layer_count)
        for turns, stretches in zip(self.turns, self.stretches, strict=True):
            require_count("turns", turns.size, 4 * len(self.base))
            require_count("stretches", stretches.size, len(self.base))

    def weighted(self, weights: np.ndarray) -> "GuideLayers":
        """Return the same layers with other weights (L, G)."""
        return replace(self, weights=np.asarray(weights, np.float32))

    def up_to(self, count: int) -> "GuideLayers":
        """Return the lowest layers, each with weight 1."""
        weights = np.ones((count, len(self.counts)), np.float32)
        return replace(self, turns=self.turns[:count], stretches=self.stretches[:count], weights=weights)


def without_layers(base: np.ndarray, counts: np.ndarray, normals: np.ndarray) -> GuideLayers:
    """Return `GuideLayers` without layers: base (N, 3), counts (G,), unit normals (G, 3) at the roots."""
    normals = _unit(np.asarray(normals, np.float64))
    normals[~normals.any(axis=1)] = (0.0, 0.0, 1.0)
    nothing = np.zeros((0, len(base), 4), np.float32)
    return GuideLayers(
        np.array(base, np.float32),
        np.asarray(counts, np.int32),
        normals.astype(np.float32),
        tangents_of(normals).astype(np.float32),
        nothing,
        nothing[..., 0],
        np.zeros((0, len(counts)), np.float32),
    )


def tangents_of(normals: np.ndarray) -> np.ndarray:
    """Return (G, 3) unit tangents at unit normals (G, 3), continuous except at a normal along -Z."""
    x, y, z = np.moveaxis(np.asarray(normals, np.float64), -1, 0)
    up = np.maximum(1.0 + z, 1e-12)
    found = np.stack([1.0 - x * x / up, -x * y / up, -x], axis=-1)
    found[up < 1e-6] = (1.0, 0.0, 0.0)
    return _unit(found - normals * np.sum(found * normals, axis=-1, keepdims=True))


def added(layers: GuideLayers) -> GuideLayers:
    """Return the layers with an empty one on top, of weight 1."""
    turns = np.zeros((1, len(layers.base), 4), np.float32)
    turns[..., 0] = 1.0
    return replace(
        layers,
        turns=np.concatenate([layers.turns, turns]),
        stretches=np.concatenate([layers.stretches, turns[..., 1]]),
        weights=np.concatenate([layers.weights, np.ones((1, len(layers.counts)), np.float32)]),
    )


def composed(layers: GuideLayers) -> np.ndarray:
    """Return the points (N, 3) float32 of guides with their layers; guides without turns are the base, bit for bit."""
    if not len(layers.turns):
        return layers.base.copy()
    return grooming.layer_kernels.compose(layers)


def composed_again(layers: GuideLayers, shape: np.ndarray, is_chosen: np.ndarray) -> np.ndarray:
    """Return the points (N, 3) of guides, where only chosen guides (G,) differ from a known shape (N, 3) float32."""
    guides = np.flatnonzero(is_chosen).astype(np.int32)
    return grooming.layer_kernels.compose(layers, guides, shape.copy()) if len(guides) else shape


def recorded(
    layers: GuideLayers,
    active: int,
    points: np.ndarray,
    shape: np.ndarray | None = None,
    is_edited: np.ndarray | None = None,
    in_place: bool = False,
) -> tuple[GuideLayers, np.ndarray]:
    """Return (layers whose layer of index `active` reproduces edited guides, (G,) bool: edited guides it reproduces).

    points: (N, 3) of the edited guides; shape: (N, 3) float32, the composed points if they are known; is_edited: (G,),
    `is_other` of points and shape if it is known; in_place: whether the arrays of `layers` may change. Other layers do
    not change. The base of a guide moves with its root. Guides for which the active layer has a weight below
    `LEAST_WEIGHT` do not change.
    """
    points = np.asarray(points, np.float32)
    require_count("edited points", len(points), len(layers.base))
    require_indices("layers", np.array([active]), len(layers.turns))
    starts = geometry.strands.curve_offsets(layers.counts)
    layers, is_moved = _rooted(layers, points, starts)
    shape = composed(layers) if shape is None else composed_again(layers, shape, is_moved)
    if is_edited is None or is_moved.any():
        is_edited = is_other(layers, points, shape)
    is_changed = is_edited & (layers.weights[active] >= LEAST_WEIGHT)
    guides = np.flatnonzero(is_changed).astype(np.int32)
    if not len(guides):
        return layers, is_changed
    if not in_place:
        layers = replace(
            layers, turns=np.array(layers.turns, order="C"), stretches=np.array(layers.stretches, order="C")
        )
    is_changed[guides] = grooming.layer_kernels.record(layers, active, points, guides, _TOLERANCE)
    return layers, is_changed


def is_other(
    layers: GuideLayers, points: np.ndarray, others: np.ndarray, is_chosen: np.ndarray | None = None
) -> np.ndarray:
    """Return (G,) bool: whether points of a guide differ from others by more than rounding; (N, 3) each.

    is_chosen: (G,) bool, guides to compare, None for all; the result is false for the others.
    """
    guide_count = len(layers.counts)
    guides = np.arange(guide_count) if is_chosen is None else np.flatnonzero(is_chosen)
    starts = geometry.strands.curve_offsets(layers.counts)
    require_count("points", len(points), int(starts[-1]))
    require_count("other points", len(others), int(starts[-1]))
    if is_chosen is not None:
        require_count("chosen guides", len(is_chosen), guide_count)
    found = np.zeros(guide_count, bool)
    found[guides] = grooming.layer_kernels.are_other(starts, points, others, guides, _TOLERANCE)
    return found


def moved(layers: GuideLayers, move: Callable[[np.ndarray], np.ndarray]) -> GuideLayers:
    """Return the layers of guides that a map of space has moved; weights do not change.

    move: a function of points (N, 3), in the order of the guides' points. Turns stay the same under rotations and
    scales, and are reflected by reflections. Under other maps, each layer together with the layers below
    makes the mapped shape.
    """
    if not len(layers.base):
        return layers
    firsts = geometry.strands.curve_offsets(layers.counts)[:-1]
    size = float(np.ptp(layers.base, axis=0).max()) or 1.0

    def moved_axis(axis):
        ends = layers.base + np.float32(0.1 * size) * np.repeat(axis, layers.counts, axis=0)
        return (np.asarray(move(ends), np.float64) - base)[firsts[has_points]]

    has_points = np.asarray(layers.counts) > 0
    base = np.asarray(move(layers.base), np.float64)
    normals, tangents = layers.normals.astype(np.float64), layers.tangents.astype(np.float64)
    sides = np.cross(normals, tangents)
    # The cross product of two moved tangents is normal to the moved surface under any affine map.
    first, second, along = (moved_axis(axis) for axis in (tangents, sides, normals))
    normal = _unit(np.cross(first, second))
    is_mirrored = np.sum(normal * along, axis=1) < 0.0
    normal[is_mirrored] *= -1.0
    tangent = _unit(first - normal * np.sum(first * normal, axis=1, keepdims=True))
    tangent[is_mirrored] *= -1.0
    is_valid = normal.any(axis=1) & tangent.any(axis=1)
    chosen = np.flatnonzero(has_points)[is_valid]
    normals[chosen], tangents[chosen] = normal[is_valid], tangent[is_valid]
    is_flipped = np.zeros(len(layers.counts), bool)
    is_flipped[np.flatnonzero(has_points)] = is_mirrored
    turns = layers.turns.copy()
    turns[:, np.repeat(is_flipped, layers.counts), 2:] *= -1.0
    followed = GuideLayers(
        base.astype(np.float32),
        layers.counts,
        normals.astype(np.float32),
        tangents.astype(np.float32),
        turns,
        layers.stretches.copy(),
        layers.weights,
    )
    for layer in range(len(turns)):
        some = followed.up_to(layer + 1)
        shape = np.asarray(move(composed(layers.up_to(layer + 1))), np.float32)
        some, _changed = recorded(some, layer, shape)
        followed.turns[layer], followed.stretches[layer] = some.turns[layer], some.stretches[layer]
    return followed


def merged(layers: GuideLayers, lower: int) -> GuideLayers:
    """Return layers in which a layer and the layer above are merged, with their weights, into one layer of weight 1.

    lower: index of the lower layer. The shapes of guides do not change.
    """
    shape = composed(layers)
    above = [index for index in range(len(layers.turns)) if index != lower + 1]
    turns, stretches = layers.turns.copy(), layers.stretches.copy()
    turns[lower] = 0.0
    stretches[lower] = 0.0
    weights = layers.weights.copy()
    weights[lower] = 1.0
    left = GuideLayers(
        layers.base,
        layers.counts,
        layers.normals,
        layers.tangents,
        turns[above],
        stretches[above],
        weights[above],
    )
    return recorded(left, lower, shape)[0]


def _rooted(layers, points, starts):
    """Return (layers whose base begins at the roots of edited guides, (G,) bool: guides whose base or frame changed).

    New guides without a base take the edited points.
    """
    has_points = np.asarray(layers.counts) > 0
    firsts, lasts = starts[:-1][has_points], starts[1:][has_points] - 1
    shifts = np.zeros((len(layers.counts), 3), np.float32)
    shifts[has_points] = points[firsts] - layers.base[firsts]
    is_new = np.zeros(len(layers.counts), bool)
    is_new[has_points] = ~(_are_not_zero(layers.base[firsts]) | _are_not_zero(layers.base[lasts]))
    for guide in np.flatnonzero(is_new):
        is_new[guide] = not layers.base[starts[guide] : starts[guide + 1]].any()
    normals, tangents, base = layers.normals, layers.tangents, layers.base
    is_moved = is_new | _are_not_zero(shifts)
    if is_moved.any():
        base = base + np.repeat(shifts, layers.counts, axis=0)
    if is_new.any():
        of_new = np.repeat(is_new, layers.counts)
        base = np.where(of_new[:, None], points, base)
        turns, stretches = np.array(layers.turns, order="C"), np.array(layers.stretches, order="C")
        turns[:, of_new], stretches[:, of_new] = (1.0, 0.0, 0.0, 0.0), 0.0
        layers = replace(layers, turns=turns, stretches=stretches)
    no_axes = ~(_are_not_zero(normals) & _are_not_zero(tangents))
    if no_axes.any():
        normals, tangents = normals.copy(), tangents.copy()
        normals[no_axes] = (0.0, 0.0, 1.0)
        tangents[no_axes] = (1.0, 0.0, 0.0)
    return replace(layers, base=base, normals=normals, tangents=tangents), is_moved | no_axes


def _are_not_zero(vectors):
    """Return (G,) bool for vectors (G, 3); `any` along so short an axis takes ten times as long."""
    return (vectors[:, 0] != 0.0) | (vectors[:, 1] != 0.0) | (vectors[:, 2] != 0.0)


def _unit(vectors):
    sizes = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(sizes > 0.0, sizes, 1.0)
