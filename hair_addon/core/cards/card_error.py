# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of cards: how much their pictures differ from those of the strands that they replace."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..imaging.flip import flip
from ..long_work import Progress, no_progress
from .card_layout import CardStrands
from .card_views import PIXELS, SAMPLES, Sides, View
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


class Comparison:
    """Views of strands, with which cards are compared; samples: along each side of a view, a multiple of 128."""

    def __init__(self, strands: CardStrands, progress: Progress = no_progress, samples: int = SAMPLES) -> None:
        self._sides = Sides(strands.points, strands.surface, samples)
        self._views = []
        for view in self._sides.of_strands(strands.points, strands.radii, strands.colors):
            progress("Comparing cards with strands", len(self._views) / 6.0)
            self._views.append(view)

    def error_of(self, mesh: PolygonMesh, maps: dict[str, np.ndarray]) -> CardError:
        """Return the `CardError` of cards with textures of `TexelSums.maps`."""
        return card_error(self._views, self._sides.of_cards(mesh, maps))


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
    (_, covered), (_, other_covered) = one, other
    either = np.maximum(covered, other_covered)
    total = max(either.sum(), 1e-12)
    visible = flip(_shown(*one), _shown(*other))
    return np.abs(covered - other_covered).sum() / total, (visible * either).sum() / total


def _shown(colors, coverage):
    """Return sRGB values (n, n, 3) in front of the background."""
    return srgb(colors + (1.0 - coverage[..., None]) * _BACKGROUND)
