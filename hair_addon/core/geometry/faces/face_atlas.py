# SPDX-License-Identifier: GPL-3.0-or-later
"""UV maps in which each polygon has a square block of its own, so that none overlap."""

import math

import numpy as np

from ...errors import HairError
from ..mesh import Faces

_LEAST = 4  # texels along a side of a block
_LARGEST_SIDE = 4096  # texels


def face_atlas(faces: Faces, vertices: np.ndarray, side: int) -> tuple[np.ndarray, int]:
    """Return ((C, 2) float32 UVs of corners, side of the picture [texels]: a power of two, at least `side`).

    vertices: (V, 3); blocks are larger for larger polygons. The first corners of a triangle and the corners of a quad
    are at the corners of its block, one texel inside; other polygons are regular. Raises `HairError` for meshes with
    too many polygons.
    """
    count = len(faces.starts) - 1
    while count * _LEAST**2 > side * side:
        side *= 2
    if side > _LARGEST_SIDE:
        raise HairError("Materials can be baked only on meshes with fewer than a million faces.")
    sizes = _block_sizes(_areas(faces, vertices), side)
    order = np.argsort(-sizes, kind="stable")
    ends = np.cumsum(sizes[order] ** 2)
    corners = np.empty((count, 2), np.int64)
    # Squares of decreasing powers of two follow one another without gaps along a Z-order curve.
    corners[order] = np.stack(_even_and_odd_bits(ends - sizes[order] ** 2), axis=1)
    counts = np.diff(faces.starts)
    polygon = np.repeat(np.arange(count), counts)
    inside = (sizes[polygon, None] - 2) * _unit_places(faces, counts) + 1.0
    return ((corners[polygon] + inside) / side).astype(np.float32), side


def _areas(faces, vertices):
    """Return (F,) areas of polygons, by Newell's normals; 0 for non-finite areas."""
    places = np.asarray(vertices, np.float64)[faces.corner_vertices]
    following = np.arange(1, len(places) + 1)
    following[faces.starts[1:] - 1] = faces.starts[:-1]
    with np.errstate(all="ignore"):
        normals = np.add.reduceat(np.cross(places, places[following]), faces.starts[:-1])
        areas = 0.5 * np.linalg.norm(normals, axis=1)
    return np.where(np.isfinite(areas), areas, 0.0)


def _block_sizes(areas, side):
    """Return (F,) sides of blocks that fit into a square: powers of two, about proportional to the roots of areas."""
    largest = int(math.log2(side))
    with np.errstate(divide="ignore"):
        roots = 0.5 * np.log2(areas / (areas.sum() or 1.0)) + largest
    for halving in range(4 * largest):
        powers = np.clip(np.floor(roots - 0.25 * halving), math.log2(_LEAST), largest).astype(np.int64)
        if (4**powers).sum() <= side * side:
            break
    return 2**powers


def _even_and_odd_bits(index):
    x = y = np.zeros_like(index)
    for bit in range(24):
        x = x | ((index >> 2 * bit & 1) << bit)
        y = y | ((index >> 2 * bit + 1 & 1) << bit)
    return x, y


def _unit_places(faces, counts):
    """Return (C, 2) places of corners in the unit square."""
    within = np.arange(len(faces.corner_vertices)) - np.repeat(faces.starts[:-1], counts)
    around = np.repeat(counts, counts)
    turn = 2.0 * np.pi * within / around
    places = 0.5 + 0.5 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    places[around == 4] = square[within[around == 4]]
    places[around == 3] = square[[0, 1, 3]][within[around == 3]]
    return places
