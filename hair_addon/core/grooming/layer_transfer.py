# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of guides carried to another set of guides, by the weights with which strands follow guides (Eq. 9).

The weights are squared: combing is blurred less, and is restored better after a change of the number of guides.

Turns are averaged as rotation vectors in the frames of the roots: the vector of each guide is carried to the other root
by the least rotation between the normals.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .. import geometry
from .guide_layers import GuideLayers, added, recorded
from .guide_shapes import rotations

SAME_PLACE = 1e-6  # of the extent of the roots: guides at a smaller distance are the same
_OF_GUIDES, _OF_LAYERS = ("base", "counts", "normals", "tangents"), ("turns", "stretches", "weights")


def transferred(
    layers: GuideLayers, others: GuideLayers, indices: np.ndarray, weights: np.ndarray, apart: np.ndarray | None = None
) -> GuideLayers:
    """Return other guides (M) with the layers of guides; the layers' weights (L, M) are interpolated too.

    others: `GuideLayers` without layers; indices (M, k): guides that these follow, -1 for none, with weights
    (M, k); apart (M,): distance to the first of them, as a fraction of the extent of the roots, None if unknown. A
    guide at the place of another guide with as many points takes its turns bit for bit.
    """
    indices, weights, is_same = _shares(layers, others, np.asarray(indices), weights, apart)
    found = others
    for _layer in layers.turns:
        found = added(found)
    found = replace(found, weights=np.einsum("mk,lmk->lm", weights, layers.weights[:, indices]).astype(np.float32))
    _write_means(found, layers, indices, weights)
    _write_same(found, layers, np.flatnonzero(is_same), indices[is_same, 0])
    return found


def _shares(layers, others, indices, weights, apart):
    """Return (indices without -1, squared weights (M, k) of sum 1, (M,) bool: guides that are the same as their first).

    Arguments: as in `transferred`.
    """
    weights = np.where(indices >= 0, weights, 0.0).astype(np.float64) ** 2
    sums = weights.sum(axis=1, keepdims=True)
    weights = np.where(sums > 0.0, weights / np.where(sums > 0.0, sums, 1.0), 0.0)
    weights[sums[:, 0] == 0.0, 0] = 1.0
    indices = np.maximum(indices, 0)
    is_same = np.zeros(len(indices), bool)
    if apart is not None:
        is_same = (apart <= SAME_PLACE) & (np.asarray(layers.counts)[indices[:, 0]] == others.counts)
        weights[is_same] = 0.0
        weights[is_same, 0] = 1.0
    return indices, weights, is_same


def _write_means(found, layers, indices, weights):
    """Write weighted means of turns and stretches to layers of other guides; indices, weights: from `_shares`."""
    starts, other_starts = geometry.strands.curve_offsets(layers.counts), geometry.strands.curve_offsets(found.counts)
    vectors = _root_vectors(layers)
    axes, other_axes = _axes(layers), _axes(found)
    for count in np.unique(found.counts[found.counts > 1]):
        chosen = np.flatnonzero(found.counts == count)
        places = other_starts[chosen][:, None] + np.arange(1, count)
        turns = np.zeros((len(layers.turns), len(chosen), int(count) - 1, 3))
        stretches = np.zeros(turns.shape[:-1])
        for slot in range(indices.shape[1]):
            share, sources = weights[chosen, slot], indices[chosen, slot]
            rows = np.flatnonzero(share > 0.0)
            if not len(rows):
                continue
            sampled = _sampled(starts, np.asarray(layers.counts), sources[rows], int(count))
            carry = rotations(axes[sources[rows], :, 2], other_axes[chosen[rows], :, 2])
            # The columns of axes are a frame: `into` maps a root's vector in space to the other root's frame.
            into = np.swapaxes(other_axes[chosen[rows]], 1, 2) @ carry
            turned = np.einsum("mij,lmpj->lmpi", into, vectors[:, sampled])
            turns[:, rows] += share[rows][None, :, None, None] * turned
            stretches[:, rows] += share[rows][None, :, None] * layers.stretches[:, sampled]
        found.turns[:, places] = _quaternions(turns)
        found.stretches[:, places] = stretches


def _write_same(found, layers, guides, sources):
    """Copy turns, stretches and frames to guides (N,) from sources (N,) at the same places, bit for bit."""
    starts, other_starts = geometry.strands.curve_offsets(layers.counts), geometry.strands.curve_offsets(found.counts)
    for guide, source in zip(guides, sources, strict=True):
        own = slice(other_starts[guide], other_starts[guide + 1])
        found.turns[:, own] = layers.turns[:, starts[source] : starts[source + 1]]
        found.stretches[:, own] = layers.stretches[:, starts[source] : starts[source + 1]]
    found.tangents[guides], found.normals[guides] = layers.tangents[sources], layers.normals[sources]


def at_points(layers: GuideLayers, points: np.ndarray, is_chosen: np.ndarray) -> GuideLayers:
    """Return layers that give chosen guides (G,) points (N, 3); the layer that turns a guide most stores the
    difference.

    Roots do not move. Where guides turn by more than half a circle, as around a tie, means of turns are far from means
    of points.
    """
    turning = 2.0 * np.arctan2(np.linalg.norm(layers.turns[..., 1:], axis=-1), np.abs(layers.turns[..., 0]))
    starts = geometry.strands.curve_offsets(layers.counts)
    points = np.array(points, np.float32)
    points[starts[:-1]] = layers.base[starts[:-1]]
    of_guides = layers.weights * np.add.reduceat(turning, starts[:-1], axis=1)
    for layer in range(len(layers.turns)):
        is_own = is_chosen & (of_guides.argmax(axis=0) == layer)
        layers = recorded(layers, layer, points, is_edited=is_own)[0]
    return layers


def chosen_guides(layers: GuideLayers, kept: np.ndarray) -> GuideLayers:
    """Return some guides with their layers; kept (M,): indices of these guides."""
    starts = geometry.strands.curve_offsets(layers.counts)
    of_points = np.concatenate([np.zeros(0, int), *(np.arange(starts[g], starts[g + 1]) for g in kept)])
    return GuideLayers(
        layers.base[of_points],
        np.asarray(layers.counts)[kept],
        layers.normals[kept],
        layers.tangents[kept],
        layers.turns[:, of_points],
        layers.stretches[:, of_points],
        layers.weights[:, kept],
    )


def joined(parts: Sequence[GuideLayers]) -> GuideLayers:
    """Return the guides of several sets with the same layers, one set after another."""
    of_guides = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _OF_GUIDES}
    of_layers = {name: np.concatenate([getattr(part, name) for part in parts], axis=1) for name in _OF_LAYERS}
    return GuideLayers(**of_guides, **of_layers)


def _sampled(starts, counts, sources, count):
    """Return (M, count - 1) indices of the points that end the segments of guides, at equal fractions."""
    segments = np.maximum(counts[sources] - 1, 1)[:, None]
    places = (np.arange(count - 1) + 0.5) / (count - 1)
    offsets = 1 + np.minimum((places[None] * segments).astype(np.int64), segments - 1)
    return starts[sources][:, None] + np.minimum(offsets, counts[sources][:, None] - 1)


def _axes(layers):
    """Return (G, 3, 3): columns tangent, side and normal of each root's frame."""
    normals, tangents = layers.normals.astype(np.float64), layers.tangents.astype(np.float64)
    return np.stack([tangents, np.cross(normals, tangents), normals], axis=2)


def _root_vectors(layers):
    """Return (L, N, 3) rotation vectors of turns, in space, by the frames of the roots."""
    quaternions = layers.turns.astype(np.float64)
    axis = quaternions[..., 1:]
    sine = np.linalg.norm(axis, axis=-1)
    angle = 2.0 * np.arctan2(sine, quaternions[..., 0])
    angle = np.where(sine > 0.0, angle, 0.0)
    vectors = axis * (angle / np.where(sine > 0.0, sine, 1.0))[..., None]
    return np.einsum("nij,lnj->lni", np.repeat(_axes(layers), layers.counts, axis=0), vectors)


def _quaternions(vectors):
    """Return quaternions (..., 4) w, x, y, z of rotation vectors (..., 3)."""
    angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
    sines = np.sin(0.5 * angles) / np.where(angles > 0.0, angles, 1.0)
    return np.concatenate([np.cos(0.5 * angles), vectors * sines], axis=-1)
