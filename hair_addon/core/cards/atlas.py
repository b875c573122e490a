# SPDX-License-Identifier: GPL-3.0-or-later
"""Layout of cards' pictures in a texture, and the sharing of pictures between cards."""

from dataclasses import dataclass

import numpy as np

from ..errors import HairError
from ..geometry.search import clusters
from .outlines import Outlines

_BORDER = 2.0  # empty texels around a picture
_TRIALS = 40
_STATIONS = 8  # places along a card at which outlines are compared


@dataclass(frozen=True)
class Atlas:
    """Pictures of K cards in a square texture, for C cards.

    shown: (K,) index of each picture's card; picture_of: (C,) index of each card's picture; corners: (K, 2) of
    pictures, from 0 to 1; scale: of all pictures, in fractions of the texture's side per unit of length.
    """

    shown: np.ndarray
    picture_of: np.ndarray
    corners: np.ndarray
    sizes: np.ndarray  # (K, 2)
    scale: float

    def placed(self, flat: np.ndarray, radii: np.ndarray, labels: np.ndarray, boxes: np.ndarray) -> tuple:
        """Return (indices, places, radii) of the flattened strands of the shown cards in the texture.

        indices: (M,) of strands; places: (M, P, 3) from 0 to 1, with heights in the same unit; radii: (M, P).
        """
        picture = np.full(len(boxes), -1)
        picture[self.shown] = np.arange(len(self.shown))
        strands = np.flatnonzero(picture[labels] >= 0)
        card = labels[strands]
        places = flat[strands] * self.scale
        offsets = self.corners[picture[card]] - boxes[card, :2] * self.scale
        places[..., :2] += offsets[:, None]
        return strands, places.astype(np.float32), (radii[strands] * self.scale).astype(np.float32)

    def uvs(self, found: Outlines) -> np.ndarray:
        """Return UV coordinates (C, n, 2, 2) of the low and high edges of cards.

        Shown cards cut their picture along their outline; other cards stretch a whole picture over their outline.
        """
        boxes = found.boxes
        edges = np.stack([found.low, found.high], axis=-1)
        across = (edges - boxes[:, 0, None, None]) / boxes[:, 2, None, None]
        others = np.ones(len(boxes), bool)
        others[self.shown] = False
        across[others] = (0.0, 1.0)
        along = (found.along - boxes[:, 1, None]) / boxes[:, 3, None]
        inside = np.stack([across, np.broadcast_to(along[..., None], across.shape)], axis=-1)
        corners, sizes = self.corners[self.picture_of], self.sizes[self.picture_of]
        return corners[:, None, None] + sizes[:, None, None] * inside


def atlas(found: Outlines, strand_counts: np.ndarray, picture_count: int, texture_size: int) -> Atlas:
    """Return the `Atlas` of cards' pictures; picture_count: most pictures, 0 for one picture per card.

    strand_counts: (C,) number of strands of each card; texture_size: texels along a side. Cards that share a picture
    are similar in shape and in number of strands. Raises `HairError` if pictures do not fit.
    """
    boxes = found.boxes
    if 0 < picture_count < len(boxes):
        features = _features(found, strand_counts)
        picture_of = clusters.clusters(features, picture_count)
        shown = clusters.medoids(features, picture_of, picture_count)
    else:
        shown = picture_of = np.arange(len(boxes))
    corners, scale = _shelves(boxes[shown, 2:], _BORDER / texture_size)
    sizes = boxes[shown, 2:] * scale
    if np.median(sizes) * texture_size < 2.0:
        raise HairError(
            "{count} pictures do not fit into {size} × {size} pixels: use larger textures, or fewer pictures.",
            count=len(shown),
            size=texture_size,
        )
    return Atlas(shown, picture_of, corners, sizes, scale)


def _features(found, strand_counts):
    boxes = found.boxes
    stations = np.linspace(0.0, 1.0, _STATIONS)
    parts = (found.along - boxes[:, 1, None]) / boxes[:, 3, None]
    widths = (found.high - found.low) / boxes[:, 2, None]
    profile = np.stack([np.interp(stations, part, width) for part, width in zip(parts, widths, strict=True)])
    logs = np.log(np.stack([boxes[:, 2], boxes[:, 3], strand_counts], axis=1))
    return np.concatenate([logs, profile / np.sqrt(_STATIONS)], axis=1).astype(np.float32)


def _shelves(sizes, border):
    """Return ((K, 2) corners, scale) of rectangles on shelves, longest first, at the largest scale that fits."""
    order = np.argsort(-sizes[:, 1], kind="stable")
    low, high = 0.0, min(1.0 / np.sqrt(sizes.prod(axis=1).sum()), *((1.0 - 2.0 * border) / sizes.max(axis=0)))
    best = None
    for _ in range(_TRIALS):
        scale = 0.5 * (low + high)
        corners = _stacked(sizes[order] * scale + 2.0 * border)
        if corners is None:
            high = scale
        else:
            low, best = scale, corners
    if best is None:
        raise HairError("Too many pictures for the texture: use larger textures, or fewer pictures.")
    places = np.empty(sizes.shape)
    places[order] = best + border
    return places, low


def _stacked(sizes):
    """Return lower left corners (K, 2) of rectangles in rows from the bottom; None if the unit square is too small."""
    corners, sums = np.empty(sizes.shape), np.concatenate([[0.0], np.cumsum(sizes[:, 0])])
    first, height = 0, 0.0
    while first < len(sizes):
        last = int(np.searchsorted(sums, sums[first] + 1.0, side="right")) - 1
        if last <= first or height + sizes[first, 1] > 1.0:
            return None
        corners[first:last, 0], corners[first:last, 1] = sums[first:last] - sums[first], height
        height += sizes[first, 1]
        first = last
    return corners
