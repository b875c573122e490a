# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of cards: how much their pictures differ from those of the strands that they replace."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..imaging.flip import flip
from ..long_work import Progress, no_progress
from .card_layout import CardStrands
from .card_views import PIXELS, SAMPLES, SIDES, Sides, View
from .polygon_mesh import PolygonMesh
from .texels import srgb

_BACKGROUND = 0.18  # linear gray behind the hair


@dataclass(frozen=True)
class CardError:
    """Errors between 0 and 1, means over six sides and three distances.

    coverage: the difference of the covered parts of pixels, relative to the part that either picture covers; flip: the
    visible difference [Andersson20], weighted by that part.
    """

    coverage: float
    flip: float

    @property
    def mean(self) -> float:
        """The mean of both errors, by which placements are compared."""
        return 0.5 * (self.coverage + self.flip)


@dataclass(frozen=True)
class CardShares:
    """Shares of N cards in the six views.

    errors: (N,) of the pixels in which cards or their strands are visible; seen: (N,) number of visible samples.
    """

    errors: np.ndarray
    seen: np.ndarray


class Comparison:
    """Views of strands for comparison with cards.

    samples: number along each side of a view, a multiple of 128; sides: (N, 3, 3) as in `Sides`.
    """

    def __init__(
        self,
        strands: CardStrands,
        progress: Progress = no_progress,
        samples: int = SAMPLES,
        sides: np.ndarray = SIDES,
    ) -> None:
        self._sides = Sides(strands.points, strands.surface, samples, sides)
        self._views = []
        for view in self._sides.of_strands(strands.points, strands.radii, strands.colors):
            progress("Comparing cards with strands", len(self._views) / len(sides))
            self._views.append(view)

    def error_of(self, mesh: PolygonMesh, maps: dict[str, np.ndarray]) -> CardError:
        """Return the `CardError` of cards with textures of `TexelSums.maps`."""
        return card_error(self._views, self._sides.of_cards(mesh, maps))

    def shares_of(
        self, mesh: PolygonMesh, maps: dict[str, np.ndarray], segment_count: int, labels: np.ndarray
    ) -> tuple[CardError, CardShares]:
        """Return the `CardError` and the `CardShares` of cards with `segment_count` quads each.

        labels: (S,) the card of each strand, -1 without one.
        """
        views = list(self._sides.of_cards(mesh, maps))
        count = (len(mesh.faces.starts) - 1) // segment_count
        errors, seen = np.zeros(count), np.zeros(count)
        for one, other in zip(self._views, views, strict=True):
            step = len(one.seen) // PIXELS[0]
            error = np.kron(_pixel_errors(one.pixels(PIXELS[0]), other.pixels(PIXELS[0])), np.ones((step, step)))
            is_card, is_strand = other.seen >= 0, one.seen >= 0
            cards, of_strands = other.seen[is_card] // segment_count, labels[one.seen[is_strand]]
            seen += np.bincount(cards, minlength=count)
            errors += np.bincount(cards, error[is_card], count)
            on_card = of_strands >= 0
            errors += np.bincount(of_strands[on_card], error[is_strand][on_card], count)
        return card_error(self._views, views), CardShares(errors, seen)


def card_error(strands: Iterable[View], cards: Iterable[View]) -> CardError:
    """Return the `CardError` of views of cards and of the strands from the same sides."""
    errors = [
        _error(one.pixels(count), other.pixels(count))
        for one, other in zip(strands, cards, strict=True)
        for count in PIXELS
    ]
    coverage, visible = np.mean(errors, axis=0)
    return CardError(float(coverage), float(visible))


def _error(one, other):
    """Return (coverage, flip) errors of two pictures of one side and distance."""
    total = max(np.maximum(one[1], other[1]).sum(), 1e-12)
    return tuple(errors.sum() / total for errors in _parts(one, other))


def _pixel_errors(one, other):
    """Return the sum (n, n) of the errors of coverage and FLIP of each pixel."""
    return sum(_parts(one, other))


def _parts(one, other):
    """Return the errors (n, n) of coverage and FLIP in each pixel."""
    (_, covered), (_, other_covered) = one, other
    visible = flip(_shown(*one), _shown(*other))
    return np.abs(covered - other_covered), visible * np.maximum(covered, other_covered)


def _shown(colors, coverage):
    """Return sRGB values (n, n, 3) in front of the background."""
    return srgb(colors + (1.0 - coverage[..., None]) * _BACKGROUND)
