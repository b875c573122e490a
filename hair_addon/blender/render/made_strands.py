# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that follow combed guides where they are drawn: nothing is computed on this side until they are written.

That holds for hair that stands still, without styles. All other hair takes the way of points that Warp computes.
"""

from dataclasses import dataclass
from typing import Any

from ...core.errors import HairError
from ..gpu import maker_choice, strand_maker
from ..groom.bindings import BoundHair
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

    maker: strand_maker.StrandMaker | None = None
    is_chosen: bool = False  # whether it is to make them with the next edit
    is_refused: bool = False  # whether the driver makes no such strands
    due: BoundHair | None = None  # whose guides were combed: the next redraw makes its strands
    _binding: Any = None  # `HairBinding` of the maker

    def can(self, bound: BoundHair) -> bool:
        """Whether strands follow guides as these are: without styles."""
        return not self.is_refused and bound.styles.styling is None

    def make(self, kept: Any) -> bool:
        """Make the strands that `hair_cache` keeps. False where the driver cannot, for which they are then due."""
        bound = self.due
        try:
            if self.maker is None or self._binding is not bound.binding:
                strands = strand_maker.bound_strands(bound.binding)
                self.maker = strand_maker.new_maker(strands, kept.on_gpu.point_count, bound.surface.to_local_axes)
                self._binding = bound.binding
            kept.on_gpu = self.maker.make(kept.on_gpu, bound.guides.numpy())
        except HairError:
            self.is_refused, self.is_chosen = True, False
            return False
        self.due = None
        return True

