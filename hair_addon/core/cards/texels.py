# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of cards: means of strand attributes over the samples of each texel."""

from dataclasses import dataclass

import numpy as np

MAPS = ("color", "alpha", "normal", "depth", "root", "id")
NO_STRAND = -1


@dataclass(frozen=True)
class PlacedStrands:
    """Strands in a texture: places (M, P, 3) from 0 to 1 with heights, radii (M, P), linear colors (M, P, 3), ids (M,).

    heights: the lowest and the highest height in the same unit, which have the depths 0 and 1; reaches: (M,) part of
    each strand's length, from the root, that is in the texture, or None for whole strands; roughness: (M,), None if it
    does not vary.
    """

    places: np.ndarray
    radii: np.ndarray
    colors: np.ndarray
    ids: np.ndarray
    heights: tuple[float, float]
    reaches: np.ndarray | None = None
    roughness: np.ndarray | None = None


class TexelSums:
    """Sums over samples for square textures with `size` texels along a side; has_roughness: of the strands."""

    def __init__(self, size: int, has_roughness: bool = False) -> None:
        self.size, self._sample_count = size, 0
        self._covered = np.zeros(size * size)
        self._sums = np.zeros((12 + has_roughness, size * size), np.float32)

    def add(self, segments: np.ndarray, strands: PlacedStrands, per_side: int, shift: np.ndarray, rows: range) -> None:
        """Add a pass of per_side² samples per texel, for some rows of texels.

        segments: (len(rows) · per_side, size · per_side), bottom row first: the index strand · (P - 1) + piece of the
        segment that each sample shows, or `NO_STRAND`; shift: (2,) [samples] offset of the picture.
        """
        if rows.start == 0:
            self._sample_count += per_side**2
        wide = self.size * per_side
        seen = np.flatnonzero(segments.ravel() != NO_STRAND)
        shown = segments.ravel()[seen]
        y, x = np.divmod(seen, wide)
        y += rows.start * per_side
        texels = (y // per_side) * self.size + x // per_side
        centres = (np.stack([x, y], axis=1) + 0.5 - shift) / wide
        values = _sampled(strands, shown, centres, 1.0 / self.size)
        self._covered += np.bincount(texels, minlength=len(self._covered))
        for sums, value in zip(self._sums, values, strict=True):
            sums += np.bincount(texels, weights=value, minlength=len(self._covered))

    def maps(self) -> dict[str, np.ndarray]:
        """Return {map: (size, size) or (size, size, 3) float32} of `MAPS`, "tangent" and possibly "roughness", from 0
        to 1.

        The bottom row is the first one. Colors are linear RGB; normals, and tangents from root to tip, are in tangent
        space, mapped from [-1, 1]. Texels without strands are filled from their surroundings.
        """
        side = self.size, self.size
        alpha = (self._covered / self._sample_count).reshape(side).astype(np.float32)
        means = _filled(self._sums.T.reshape(*side, -1), self._covered.reshape(side).astype(np.float32))
        normals, tangents = _unit(means[..., 3:6]), _unit(means[..., 9:12])
        shades = {name: means[..., 6 + index].clip(0.0, 1.0) for index, name in enumerate(("depth", "root", "id"))}
        if means.shape[-1] > 12:
            shades["roughness"] = means[..., 12].clip(0.0, 1.0)
        directions = {"normal": 0.5 * normals + 0.5, "tangent": 0.5 * tangents + 0.5}
        return {"color": means[..., :3], "alpha": alpha, **directions, **shades}


def _sampled(strands, segments, centres, texel):
    """Return (12, N) color, normal, depth, fraction from root to tip, ID and tangent of samples at centers (N, 2).

    The roughness, if it varies, is one more row. texel: width of a texel. Thinner strands are shaded as flat, because
    both sides fall into one texel.
    """
    pieces = strands.places.shape[1] - 1
    strand, piece = np.divmod(segments, pieces)
    first, second = strands.places[strand, piece], strands.places[strand, piece + 1]
    edge = second - first
    flat = edge[:, :2]
    square = np.maximum((flat**2).sum(axis=1), 1e-18)
    offset = centres - first[:, :2]
    part = np.clip((offset * flat).sum(axis=1) / square, 0.0, 1.0)
    mix = part[:, None]
    colors = strands.colors[strand, piece] * (1.0 - mix) + strands.colors[strand, piece + 1] * mix
    across = (offset[:, 1] * flat[:, 0] - offset[:, 0] * flat[:, 1]) / np.sqrt(square)
    radius = strands.radii[strand, piece] * (1.0 - part) + strands.radii[strand, piece + 1] * part
    roundness = np.minimum(2.0 * radius / texel, 1.0)
    normals = _normals(edge, roundness * np.clip(across / np.maximum(radius, 1e-12), -1.0, 1.0))
    low, high = strands.heights
    depth = (first[:, 2] + part * edge[:, 2] - low) / max(high - low, 1e-12)
    along = (piece + part) / pieces
    if strands.reaches is not None:
        along = along * strands.reaches[strand]
    roughness = [] if strands.roughness is None else [strands.roughness[strand]]
    return np.stack([*colors.T, *normals.T, depth, along, strands.ids[strand], *_unit(edge).T, *roughness])


def _unit(vectors):
    """Return normalized vectors (..., 3); vectors of zero length stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def _normals(edges, across):
    """Return unit normals (N, 3) of fibers seen from above; across: (N,) positions across their width in [-1, 1]."""
    tangents = _unit(edges)
    facing = np.array([0.0, 0.0, 1.0]) - tangents[:, 2:] * tangents
    length = np.linalg.norm(facing, axis=1, keepdims=True)
    facing = np.where(length > 1e-6, facing / np.maximum(length, 1e-6), (0.0, 0.0, 1.0))
    side = np.cross(facing, tangents)  # direction of increasing `across`
    return np.sqrt(1.0 - across**2)[:, None] * facing + across[:, None] * side


def _filled(sums, weights):
    """Return means (n, n, k); the next coarser level of a pyramid fills texels without weight (pull-push)."""
    means = sums / np.maximum(weights, 1e-12)[..., None]
    if len(sums) == 1 or not (weights == 0.0).any():
        return means
    if len(sums) % 2:
        wider = _filled(np.pad(sums, ((0, 1), (0, 1), (0, 0))), np.pad(weights, (0, 1)))
        return wider[:-1, :-1]
    half = len(sums) // 2
    blocks = (means * (weights > 0.0)[..., None]).reshape(half, 2, half, 2, -1).sum(axis=(1, 3))
    counts = (weights > 0.0).astype(np.float32).reshape(half, 2, half, 2).sum(axis=(1, 3))
    coarse = np.repeat(np.repeat(_filled(blocks, counts), 2, axis=0), 2, axis=1)
    return np.where((weights > 0.0)[..., None], means, coarse)


def srgb(linear: np.ndarray) -> np.ndarray:
    """Return sRGB values of linear values, clipped to [0, 1], by the transfer function of IEC 61966-2-1."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
