# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that follow combed guides where they are drawn: nothing is computed on this side until they are written.

That holds for hair that stands still, with styles that the GPU can apply. All other hair takes the way of points that
Warp computes.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors import HairError
from ..gpu import maker_choice, strand_maker, style_maker
from ..groom.bindings import BoundHair
from ..host import running
from ..settings import preferences

# Of how far guides were combed: what strands may be further out of their box than they were.
_FURTHER = 0.1


def are_wanted() -> bool:
    """Whether strands are to be made where they are drawn: as the user chose, or by what is measured once.

    To be asked while something is drawn.
    """
    chosen = preferences.stroke_device()
    if chosen == "COMPUTE" or not running.has_window():
        return False
    return maker_choice.can_make() if chosen == "GPU" else maker_choice.is_faster()


@dataclass(frozen=True)
class _Extent:
    """Guides (G, P, 3) as strands are drawn, the box (2, 3) around them, and that of the strands that they had."""

    guides: np.ndarray
    box: np.ndarray
    bounds: np.ndarray

    def bounds_for(self, guides: np.ndarray) -> np.ndarray:
        """(2, 3): a box that strands stay in when guides are combed, estimated without them.

        A strand goes no further than the guide that goes furthest, and no further out of a side of the guides' box than
        any did before, but for turns from root to root: a part of that way.
        """
        way = np.linalg.norm(np.abs(_box(guides - self.guides)).max(axis=0))
        (low, high), (low_before, high_before) = _box(guides), self.box
        further = _FURTHER * way
        low = low - np.maximum(low_before - self.bounds[0], 0.0) - further
        high = high + np.maximum(self.bounds[1] - high_before, 0.0) + further
        least, greatest = np.maximum(low, self.bounds[0] - way), np.minimum(high, self.bounds[1] + way)
        return np.stack([np.minimum(self.bounds[0], least), np.maximum(self.bounds[1], greatest)]).astype(np.float32)


@dataclass
class Making:
    """What makes the strands of one hair, and of which guides."""

    maker: strand_maker.StrandMaker | style_maker.StyleMaker | None = None
    is_chosen: bool = False  # whether it is to make them with the next edit
    is_refused: bool = False  # whether the driver makes no such strands
    due: BoundHair | None = None  # whose guides were combed: the next redraw makes its strands
    extent: _Extent | None = None  # of the strands when they were uploaded
    _binding: Any = None  # `HairBinding` of the maker

    def can(self, kept: Any, bound: BoundHair) -> bool:
        """Whether strands that `hair_cache` keeps can be made of their guides, with all their styles."""
        styling = bound.styles.styling
        if self.is_refused or (styling is not None and not style_maker.can_style(styling)):
            return False
        if self.extent is None:
            guides = _drawn(_followed(bound), bound)
            self.extent = _Extent(guides, _box(guides), kept.on_gpu.bounds.copy())
        return True

    def make(self, kept: Any) -> bool:
        """Make the strands that `hair_cache` keeps. False where the driver cannot, for which they are then due."""
        bound = self.due
        try:
            before = self.maker if self._binding is bound.binding else None
            count, axes = kept.on_gpu.point_count, bound.surface.to_local_axes
            self.maker = style_maker.maker_of(bound.binding, bound.styles.styling, count, axes, before)
            self._binding = bound.binding
            guides = _followed(bound)
            made = self.maker.make(kept.on_gpu, guides)
        except HairError:
            self.is_refused, self.is_chosen = True, False
            return False
        self.due = None
        kept.on_gpu = replace(made, bounds=_joined(made.bounds, self.extent.bounds_for(_drawn(guides, bound))))
        return True


def _followed(bound):
    """(G, P, 3): guides as strands follow them, which styles may lean."""
    styling = bound.styles.styling
    return (bound.guides if styling is None else styling.guides(bound.guides)).numpy()


def _drawn(guides, bound):
    return guides @ np.asarray(bound.surface.to_local_axes, np.float32).T


def _box(points):
    """(2, 3): least and greatest coordinates of (G, P, 3) points; NumPy is faster along a flat array's long axis."""
    flat = points.reshape(len(points), -1)
    return np.stack([flat.min(axis=0).reshape(-1, 3).min(axis=0), flat.max(axis=0).reshape(-1, 3).max(axis=0)])


def _joined(bounds, others):
    """A box around two. Boxes only grow, as in `move_strands`, until strands are uploaded again."""
    return np.stack([np.minimum(bounds[0], others[0]), np.maximum(bounds[1], others[1])])
