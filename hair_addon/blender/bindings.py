# SPDX-License-Identifier: GPL-3.0-or-later
"""What ties hair to its guides, kept while an artist combs them: by the hair's session, without Blender's data.

Nothing here is the truth. All of it follows from the surface, the guides, the settings and the roots that the hair's
Curves store, and may be forgotten at any time: the next change of a guide then searches once more.
"""

from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core import groom, hair_binding
from ..core.groom import HairSettings
from ..core.hair_binding import HairBinding
from ..core.strands import Strands
from .scene import Surface


@dataclass
class BoundHair:
    """Hair as it is now, ahead of its datablock while `is_written` is not."""

    binding: HairBinding
    settings: HairSettings
    root_key: str  # of `pipeline.root_key`
    parting_key: str  # of `partings.Partings`
    guides: Strands  # as they were when the hair followed them last
    guide_uid: int  # session_uid of their Curves
    surface: Surface
    shares: np.ndarray | None = None  # (S, k) float32, the weights of each strand's guides as they are combed now
    growing: Future | None = None  # of `points`
    is_written: bool = False  # whether the datablock holds these points
    has_moved_only: bool = False  # whether what is not written is where points are, and perhaps the guide map
    is_map_written: bool = False  # whether the datablock holds this guide map
    written_radii: np.ndarray | None = None  # (P,) that the datablock holds, None where somebody may have changed it
    is_report_due: bool = False  # whether Blender has yet to report what was written, which is no news

    @property
    def points(self):
        """(S, P, 3) float32 at rest, in the surface's local coordinates; waits until they are computed."""
        return self.growing.result()

    @property
    def radii(self):
        """(P,) float32 along every strand, in the surface's local units."""
        return groom.strand_radii(self.settings, self.guides.point_count) / np.float32(self.surface.scale)

    @property
    def guide_map(self):
        """(S, k) int32 and float32: each strand's guides, -1 for none, and their weights, as they are combed now."""
        return np.where(self.shares > 0.0, self.binding.guide_weights.indices.numpy(), -1), self.shares

    def take_shares(self, shares, moved=slice(None)):
        """Bring the guide map up to guides that were combed: the weights of strands, or of (M,) indices of them."""
        self.is_map_written = self.is_map_written and np.array_equal(shares, self.shares[moved])
        self.shares[moved] = shares

    @cached_property
    def leaders(self):
        """(S,) int32: the strand that stands for the guide that each follows first."""
        return hair_binding.leading_strands(self.surface.mesh, self.guides, self.binding)

    @cached_property
    def identities(self):
        """(S,) int32 and float32: what strands are known by, and differ by (`Surface.identities`)."""
        return self.surface.identities(self.binding.roots)

    @cached_property
    def reach(self):
        """The strands that follow each guide."""
        from ..core import guide_weights

        return guide_weights.reach(self.binding.guide_weights, len(self.guides))


_bound = {}  # session_uid → BoundHair


def keep(datablock, bound):
    """Keep what a hair Curves datablock is bound by."""
    before = of(datablock)
    if before is not None:
        bound.written_radii = before.written_radii
    _bound[datablock.session_uid] = bound


def of(datablock):
    """The `BoundHair` of a hair Curves datablock, or None."""
    return _bound.get(datablock.session_uid)


def forget(datablock):
    """Drop what is known of a datablock that was changed by somebody else."""
    _bound.pop(datablock.session_uid, None)


def clear():
    """Drop everything: after undo, with a new file."""
    _bound.clear()


def is_reported():
    """Blender has reported all that was written until now: the next report is of somebody else's doing."""
    for bound in _bound.values():
        bound.is_report_due = False


def has_unwritten():
    """Whether any hair is ahead of its datablock."""
    return any(not bound.is_written for bound in _bound.values())
