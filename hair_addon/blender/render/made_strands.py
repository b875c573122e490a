# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that follow combed guides where they are drawn: nothing is computed on this side until they are written.

That holds for hair that stands still, with styles that the GPU can apply. All other hair takes the way of points that
Warp computes.
"""

from dataclasses import dataclass
from typing import Any

from ...core.errors import HairError
from ..gpu import maker_choice, strand_maker, style_maker
from ..groom.bindings import BoundHair
from ..groom.styled_hair import StyledHair
from ..host import running
from ..settings import preferences


def are_wanted() -> bool:
    """Whether strands are to be made where they are drawn: as the user chose, or by what is measured once.

    To be asked while something is drawn.
    """
    chosen = preferences.stroke_device()
    if chosen == "COMPUTE" or not running.has_window():
        return False
    return maker_choice.can_make() if chosen == "GPU" else maker_choice.is_faster()


@dataclass
class Making:
    """What makes the strands of one hair, and of which guides."""

    maker: strand_maker.StrandMaker | style_maker.StyleMaker | None = None
    is_chosen: bool = False  # whether it is to make them with the next edit
    is_refused: bool = False  # whether the driver makes no such strands
    due: BoundHair | None = None  # whose guides were combed: the next redraw makes its strands
    _binding: Any = None  # `HairBinding` of the maker

    def can(self, bound: BoundHair) -> bool:
        """Whether strands can be made of their guides, with all their styles."""
        return not self.is_refused and self.can_style(bound.styles)

    def can_style(self, styles: StyledHair) -> bool:
        """Whether styles can be applied to them: the one place where that is decided."""
        return styles.styling is None or style_maker.can_style(styles.styling)

    def make(self, kept: Any) -> bool:
        """Make the strands that `hair_cache` keeps. False where the driver cannot, for which they are then due."""
        bound = self.due
        try:
            before = self.maker if self._binding is bound.binding else None
            count, axes = kept.on_gpu.point_count, bound.surface.to_local_axes
            self.maker = style_maker.maker_of(bound.binding, bound.styles.styling, count, axes, before)
            self._binding = bound.binding
            kept.on_gpu = self.maker.make(kept.on_gpu, _followed(bound))
        except HairError:
            self.is_refused, self.is_chosen = True, False
            return False
        self.due = None
        return True


def _followed(bound):
    """(G, P, 3): guides as strands follow them, which styles may lean."""
    styling = bound.styles.styling
    return (bound.guides if styling is None else styling.guides(bound.guides)).numpy()
