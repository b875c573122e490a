# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides gathered at drawn ties: ponytails, buns, ropes and braids, on the surface as it is posed."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import grooming
from ....core.errors import HairError
from ....core.grooming import ties
from ....core.grooming.ties.gather_settings import GatherSettings
from ...data.strands import drawn_lines
from . import guide_tools, outside_guides


def gather(datablock: Curves, settings: GatherSettings, depsgraph: Depsgraph) -> int:
    """Gather guides at the ties of a curve object; returns the number changed. Raises `HairError`."""
    guides = guide_tools.read(datablock, settings, depsgraph)
    if not settings.line:
        raise HairError("Pick a curve object: each of its curves begins at a tie and leads the tail.")
    segments = drawn_lines.read(datablock.surface, guides.surface, settings.line, depsgraph)
    lines = [] if segments is None else _lines(segments)
    mesh, after = guides.surface.posed_mesh, guides.points.copy()
    barrier = outside_guides.prepared(guides, 0.0, ())
    changed = 0
    for chosen, places in guide_tools.to_shape(guides):
        posed, is_gathered = ties.gathering.gathered(mesh, guides.posed_of(chosen, places), lines, settings)
        changed += int(is_gathered.sum())
        laid = outside_guides.pushed_posed(barrier, posed)
        at_rest = guides.carried_back(laid, chosen)
        weights = guides.weights[chosen]
        partly = grooming.guide_shapes.blended(guides.points[places], at_rest, weights)
        at_rest = np.where((weights < 1.0)[:, None, None], partly, at_rest)
        at_rest[:, 0] = guides.points[places[:, 0]]
        after[places[is_gathered]] = at_rest[is_gathered]
    if not changed:
        raise HairError("No guides were gathered, because the ties are on another part of the surface: move the curve.")
    return guide_tools.write_shapes(guides, after)


def _lines(segments):
    """Return the lines, each (K, 3), that consecutive segments (L, 2, 3) form."""
    begins = np.flatnonzero((segments[1:, 0] != segments[:-1, 1]).any(axis=1)) + 1
    return [np.concatenate([part[:1, 0], part[:, 1]]) for part in np.split(segments, begins)]
