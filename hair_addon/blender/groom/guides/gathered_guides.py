# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides gathered at drawn ties: ponytails, buns, ropes and braids, on the surface as it is posed."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import grooming
from ....core.errors import HairError
from ....core.grooming import ties
from ....core.grooming.ties.gather_settings import GatherSettings
from ...data.strands import attributes, curves, drawn_lines, gathered_groups
from ...host.notices import text_of
from . import guide_tools, outside_guides

_MEMBER = 0.5  # weight from which a guide belongs to its tie


def gather(datablock: Curves, settings: GatherSettings, depsgraph: Depsgraph) -> int:
    """Gather guides at the ties of a curve object; returns the number changed. Raises `HairError`.

    Hair between the guides is parted by the ties and locks, if no other attribute parts it.
    """
    guides = guide_tools.read(datablock, settings, depsgraph)
    if not settings.line:
        raise HairError("Pick a curve object: each of its curves begins at a tie and leads the tail.")
    segments = drawn_lines.read(datablock.surface, guides.surface, settings.line, depsgraph)
    lines = [] if segments is None else continued(_lines(segments), 2.0 * settings.tie_radius)
    mesh, after = guides.surface.posed_mesh, guides.points.copy()
    barrier = outside_guides.prepared(guides, 0.0, ())
    groups = np.zeros(len(guides.counts), np.int32)
    held, joins = np.zeros(len(groups), np.float32), np.zeros(len(groups), np.float32)
    for chosen, places in guide_tools.to_shape(guides):
        posed, found, parts, up_to = ties.gathering.gathered(mesh, guides.posed_of(chosen, places), lines, settings)
        groups[chosen], held[chosen], joins[chosen] = found, parts, up_to
        laid = outside_guides.pushed_posed(barrier, posed)
        at_rest = guides.carried_back(laid, chosen)
        weights = guides.weights[chosen]
        partly = grooming.guide_shapes.blended(guides.points[places], at_rest, weights)
        at_rest = np.where((weights < 1.0)[:, None, None], partly, at_rest)
        at_rest[:, 0] = guides.points[places[:, 0]]
        after[places[found > 0]] = at_rest[found > 0]
    if not groups.any():
        raise HairError("No guides were gathered, because the ties are on another part of the surface: move the curve.")
    changed = guide_tools.write_shapes(guides, after)
    joins = gathered_groups.of_even_points(datablock, joins)
    groups = np.where(guides.weights >= _MEMBER, groups, 0)
    gathered_groups.add(datablock, gathered_groups.Gathered(groups, held, joins))
    _part_hair(datablock)
    return changed


def _part_hair(datablock):
    """Part the hair between gathered guides by their groups."""
    for hair in curves.followers(datablock):
        if not text_of(hair.vellus.hair, "region_attribute") and not attributes.is_from_library(hair):
            hair.vellus.hair.region_attribute = gathered_groups.NAME


def continued(lines: list[np.ndarray], distance: float) -> list[np.ndarray]:
    """Return lines (K, 3) [m], joined where a line begins at most `distance` [m] from the end of another."""
    lines = list(lines)
    place = 0
    while place < len(lines):
        end = lines[place][-1]
        near = [np.linalg.norm(line[0] - end) if line is not lines[place] else np.inf for line in lines]
        following = int(np.argmin(near))
        if near[following] > distance:
            place += 1
            continue
        lines[place] = np.concatenate([lines[place], lines[following]])
        del lines[following]
        place -= following < place
    return lines


def _lines(segments):
    """Return the lines, each (K, 3), that consecutive segments (L, 2, 3) form."""
    begins = np.flatnonzero((segments[1:, 0] != segments[:-1, 1]).any(axis=1)) + 1
    return [np.concatenate([part[:1, 0], part[:, 1]]) for part in np.split(segments, begins)]
