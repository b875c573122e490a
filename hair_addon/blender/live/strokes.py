# SPDX-License-Identifier: GPL-3.0-or-later
"""What follows each event of a stroke: limits move points back, then ties stay where they are on the guides.

Undo steps of Edit Mode contain guides as they were before that, so the results are kept, and written again after undo.
"""

import numpy as np

from ...core import geometry
from ..data.strands import gathered_groups
from ..host.caches import Cache
from . import last_update, stale_marks, stroke_limits

# (session_uid of guides, whether they stay outside, fingerprint of their points) →
# (indices and places of the points that limits moved, ties if they changed)
result_cache = Cache(capacity=256)


def follow(guides, depsgraph):
    """Follow guides that have moved; returns their points (N, 3)."""
    points = last_update.points_of(guides)
    if not stroke_limits.is_combed(guides):
        return points
    if last_update.former_points_of(guides) is None:
        return _again(guides, points, depsgraph)
    allowed = stroke_limits.limited(guides, points, depsgraph)
    have_ties_moved = _follow_ties(guides, points, depsgraph)
    if have_ties_moved or allowed is not points:
        rows = np.flatnonzero((allowed != points).any(axis=1))
        ties = gathered_groups.ties_of(guides) if have_ties_moved else None
        result_cache.keep(_key(guides, points), (rows, allowed[rows], ties))
    return allowed


def _again(guides, points, depsgraph):
    """Write the results of a former event that ended with these points, if undo or redo has restored the points."""
    known = result_cache.get(_key(guides, points))
    if known is None:
        return points
    rows, places, ties = known
    if ties is not None:
        gathered_groups.write_ties(guides, ties)
        _mark_parted(guides, depsgraph)
    if not len(rows):
        return points
    allowed = points.copy()
    allowed[rows] = places
    stroke_limits.write(guides, allowed)
    return allowed


def _follow_ties(guides, moved, depsgraph):
    """Keep ties where they are on guides that a stroke has cut or lengthened; returns whether any tie has changed.

    moved: (N, 3) points before limits.
    """
    former = last_update.former_points_of(guides)
    if gathered_groups.NAME not in guides.attributes or not gathered_groups.follow_stroke(guides, former, moved):
        return False
    _mark_parted(guides, depsgraph)
    return True


def _mark_parted(guides, depsgraph):
    """Mark the hair that is parted by the ties of guides."""
    guides.update_tag()
    stale_marks.follow_partings({guides}, set(), depsgraph)


def _key(guides, points):
    return guides.session_uid, guides.vellus.keeps_outside, geometry.fingerprint.fingerprint(points)
