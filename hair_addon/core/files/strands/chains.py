# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges between points, joined to polylines."""

import numpy as np

from .contents import Damaged


def polylines(edges: np.ndarray, vertex_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (indices (N,), counts (C,)) of the polylines that edges (E, 2) form.

    Edges that are sorted along their polylines keep their order. Otherwise a polyline begins at its end with the
    smaller index, and a loop repeats its first point. Raises `Damaged` for invalid indices and for branching edges.
    """
    edges = edges.astype(np.int64)
    if len(edges) and (edges.min() < 0 or edges.max() >= vertex_count):
        raise Damaged("its lines use points that it does not have")
    edges = edges[edges[:, 0] != edges[:, 1]]
    begins = np.ones(len(edges), bool)
    begins[1:] = edges[1:, 0] != edges[:-1, 1]
    first = np.flatnonzero(begins)
    counts = np.diff(np.append(first, len(edges))) + 1
    indices = np.insert(edges[:, 1], first, edges[first, 0])
    if len(np.unique(indices)) == len(indices):
        return indices, counts
    return _walked(edges, vertex_count)


def _walked(edges, vertex_count):
    degrees = np.bincount(edges.ravel(), minlength=vertex_count)
    if degrees.max() > 2:
        raise Damaged("its lines branch, which strands cannot")
    neighbors = np.full((vertex_count, 2), -1, np.int64)
    ends = np.concatenate([edges, edges[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    is_second = np.append(False, ends[1:, 0] == ends[:-1, 0])
    neighbors[ends[:, 0], is_second.astype(np.int64)] = ends[:, 1]
    beside, is_seen = neighbors.tolist(), bytearray(vertex_count)
    indices, counts = [], []
    for starts in (np.flatnonzero(degrees == 1), np.flatnonzero(degrees == 2)):  # first lines, then loops
        for start in starts.tolist():
            line, place, before = [], start, -1
            while place >= 0 and not is_seen[place]:
                is_seen[place] = 1
                line.append(place)
                one, other = beside[place]
                place, before = (other if one == before else one), place
            if not line:
                continue
            if place == start and len(line) > 2:
                line.append(start)
            indices += line
            counts.append(len(line))
    return np.array(indices, np.int64), np.array(counts, np.int64)
