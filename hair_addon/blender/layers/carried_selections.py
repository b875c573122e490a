# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved selections of guides, which are carried to guides that are generated again.

A new guide is selected like the nearest former guide. The number of centers of locks stays the same: each is
the new guide nearest to a former center.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from bpy.types import Curves
from mathutils.kdtree import KDTree

from ..data.strands import attributes, curves, selection_sets
from ..data.surfaces import Surface
from ..settings import selection_names, style_items

_SAME = 1e-4  # largest distance of roots that count as the same, relative to the surface's extent


@dataclass(frozen=True)
class SelectionsBefore:
    """Roots (G, 3) [m] of former guides, the number of their points (G,), and {name: (N,) bool points of a set}."""

    roots: np.ndarray
    counts: np.ndarray
    sets: Mapping[str, np.ndarray]


def read(guides: Curves | None, surface: Surface) -> SelectionsBefore | None:
    """Return the `SelectionsBefore` of guides on a `Surface`; None without saved selections."""
    if guides is None or not len(guides.curves) or attributes.is_from_library(guides):
        return None
    read_sets = ((name, selection_sets.read(guides, name)) for name in selection_names.names_of(guides))
    sets = {name: points for name, points in read_sets if points is not None}
    if not sets:
        return None
    return SelectionsBefore(_roots(guides, surface), curves.point_counts(guides), sets)


def write(guides: Curves, surface: Surface, before: SelectionsBefore | None) -> None:
    """Give guides that were generated again the selections of the former guides; None for no selections."""
    if before is None:
        return
    roots, counts = _roots(guides, surface), curves.point_counts(guides)
    if (
        np.array_equal(counts, before.counts)
        and np.abs(roots - before.roots).max() <= _SAME * surface.extent * surface.scale
    ):
        return
    centers = set().union(*(style_items.center_guides_of(hair.vellus) for hair in curves.followers(guides)))
    starts = np.cumsum(before.counts) - before.counts
    is_alike = (counts == before.counts[0]).all() and (before.counts == before.counts[0]).all()
    for name, points in before.sets.items():
        chosen = np.flatnonzero(np.logical_or.reduceat(points, starts))
        source = np.full(len(roots), -1)
        if name in centers and len(chosen):
            source[_nearest(before.roots[chosen], roots)] = chosen
        else:
            nearest = _nearest(roots, before.roots)
            source = np.where(np.isin(nearest, chosen), nearest, -1)
        taken = np.repeat(source >= 0, counts)
        if is_alike:
            taken &= points.reshape(len(before.counts), -1)[source].ravel()
        selection_sets.write(guides, name, taken)


def _nearest(places, others):
    """Return the indices (N,) of the others (M, 3) nearest to places (N, 3)."""
    tree = KDTree(len(others))
    for index, place in enumerate(others.tolist()):
        tree.insert(place, index)
    tree.balance()
    return np.array([tree.find(place)[1] for place in places.tolist()], int)


def _roots(guides, surface):
    local = curves.read_points(guides)[curves.curve_offsets(guides)[:-1]]
    return surface.from_local(np.nan_to_num(local, posinf=0.0, neginf=0.0))
