# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of strands along the opaque parts of a card's texture, from its root to its tip.

The texture is a grid of cells, with rows across the card. From row to row, a group of opaque runs that overlap is
mapped to the group of the next row so that order is kept and each strand keeps its part of the opaque width: strands
draw closer where a run narrows, and share runs that split or merge. Strands end where their run does, and where it ends
abruptly on one side. Strands begin where runs begin.
"""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Paths:
    """Paths of S strands on R rows of cells.

    first, last: (S,) rows of both ends; places: (S, R) across the card, in [0, 1]; widths: (S, R) parts of the card's
    width that a strand covers. Rows before `first` and after `last` repeat these.
    """

    first: np.ndarray
    last: np.ndarray
    places: np.ndarray
    widths: np.ndarray


@dataclass(frozen=True)
class _Step:
    """Mapping from the cells of a row to the next row, of all cards: flat arrays over (card, cell).

    is_left: whether strands in a cell go on; before: number of such cells before a cell; groups: number of each cell's
    group; reached: cells of the next row in the order of groups; starts: of groups, (first in `before`, first in
    `reached`); ratios: of the number of cells after and before.
    """

    is_left: np.ndarray
    before: np.ndarray
    groups: np.ndarray
    reached: np.ndarray
    starts: tuple[np.ndarray, np.ndarray]
    ratios: np.ndarray


def traced(opaque: np.ndarray, steepness: np.ndarray, cards: np.ndarray, across: np.ndarray) -> Paths:
    """Return the `Paths` of strands on cards with opaque cells (C, R, M), from root to tip.

    steepness: (C, R - 1) most cells by which a border moves from a row to the next one gradually; cards: (S,) card of
    each strand, which has an opaque cell; across: (S,) places in [0, 1) on the opaque width where strands begin.
    """
    card_count, row_count, cell_count = opaque.shape
    occupied, begun, steps = opaque[:, 0], np.zeros(opaque.shape, bool), []
    begun[:, 0] = occupied
    for row in range(row_count - 1):
        step, occupied, begun[:, row + 1] = _next(occupied, opaque[:, row + 1], steepness[:, row, None])
        steps.append(step)
    ends = np.cumsum(begun.reshape(card_count, -1).sum(axis=1))
    firsts = np.concatenate([[0], ends[:-1]])
    sizes = ends - firsts
    at = firsts[cards] + across * sizes[cards]
    whole = np.minimum(at.astype(np.int64), ends[cards] - 1)
    cells = np.flatnonzero(begun)[whole]
    first = cells // cell_count % row_count
    place = cells % cell_count + np.minimum(at - whole, 1.0 - 1e-9)
    width = sizes[cards] / np.bincount(cards, minlength=card_count)[cards]
    places, widths = np.empty((len(cards), row_count)), np.empty((len(cards), row_count))
    last, is_alive = first.copy(), np.ones(len(cards), bool)
    for row, step in enumerate([*steps, None]):
        places[:, row], widths[:, row] = place, width
        if step is None:
            break
        moving = np.flatnonzero(is_alive & (first <= row))
        flat = cards[moving] * cell_count + place[moving].astype(np.int64)
        goes_on = step.is_left[flat]
        is_alive[moving[~goes_on]] = False
        moving, flat = moving[goes_on], flat[goes_on]
        group = step.groups[flat]
        inside = step.before[flat] + place[moving] % 1.0 - step.starts[0][group]
        after = step.starts[1][group] + inside * step.ratios[group]
        cell = np.minimum(after.astype(np.int64), len(step.reached) - 1)
        place[moving] = step.reached[cell] % cell_count + np.minimum(after - cell, 1.0 - 1e-9)
        width[moving] *= step.ratios[group]
        last[moving] = row + 1
    return Paths(first, last, places / cell_count, widths / cell_count)


def inside(paths: Paths, opaque: np.ndarray, cards: np.ndarray) -> Paths:
    """Return `Paths` away from the unknown borders of opaque runs: cells are opaque for certain only at their centers.

    In a run's outermost cells, places move into the inner half, and in a run of a single cell close to its center.
    opaque and cards: as of `traced`.
    """
    cell_count = opaque.shape[2]
    places = paths.places * cell_count
    cells = np.minimum(places.astype(np.int64), cell_count - 1)
    sides = np.pad(opaque, ((0, 0), (0, 0), (1, 1)), mode="edge")
    at = cards[:, None], np.arange(opaque.shape[1])[None]
    lows, highs = np.where(sides[*at, cells], 0.0, 0.5), np.where(sides[*at, cells + 2], 1.0, 0.5)
    is_single = highs == lows
    lows, highs = np.where(is_single, 0.4, lows), np.where(is_single, 0.6, highs)
    return replace(paths, places=(cells + lows + (highs - lows) * (places - cells)) / cell_count)


def _next(occupied, opaque, most):
    """Return (`_Step`, occupied, begun): cells (C, M) of the next row with strands, and cells where strands begin."""
    is_left, is_reached = occupied & (_gaps(opaque) <= most), opaque & (_gaps(occupied) <= most)
    groups = _runs(_widened(is_left) | _widened(is_reached))
    count = int(groups[-1]) + 1
    sizes = [np.bincount(groups[cells.ravel()], minlength=count) for cells in (is_left, is_reached)]
    is_joined = (sizes[0] > 0) & (sizes[1] > 0)
    is_left, is_reached = (cells.ravel() & is_joined[groups] for cells in (is_left, is_reached))
    sizes = [size * is_joined for size in sizes]
    runs = _runs(opaque)
    has_strands = np.bincount(runs[is_reached], minlength=int(runs[-1]) + 1) > 0
    begun = opaque & ~has_strands[runs].reshape(opaque.shape)
    step = _Step(
        is_left,
        np.cumsum(is_left) - is_left,
        groups,
        np.flatnonzero(is_reached),
        (np.cumsum(sizes[0]) - sizes[0], np.cumsum(sizes[1]) - sizes[1]),
        sizes[1] / np.maximum(sizes[0], 1),
    )
    return step, is_reached.reshape(opaque.shape) | begun, begun


def _gaps(cells):
    """Return distances (C, M) along rows to the nearest true cell, at least M without one."""
    count = cells.shape[1]
    place = np.arange(count)
    before = np.maximum.accumulate(np.where(cells, place, -count), axis=1)
    after = np.minimum.accumulate(np.where(cells, place, 2 * count)[:, ::-1], axis=1)[:, ::-1]
    return np.minimum(place - before, after - place)


def _widened(cells):
    wide = cells.copy()
    wide[:, 1:] |= cells[:, :-1]
    wide[:, :-1] |= cells[:, 1:]
    return wide


def _runs(cells):
    """Return (C * M,) numbers of the runs of true cells in rows, in order; false cells have that of the run before."""
    starts = cells.copy()
    starts[:, 1:] &= ~cells[:, :-1]
    return np.maximum(np.cumsum(starts.ravel()) - 1, 0)
