# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the number of guides: insertion between existing guides, or removal of the most crowded guides."""

import heapq
from collections.abc import Sequence

import numpy as np

from .. import grooming, placement
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.strands import Strands
from ..interpolation.regions import Regions
from . import following, groom
from .groom import HairSettings
from .guide_tool_settings import CountSettings

_POWER = 8  # of the weight between two guides  [Yuksel15]
_NEIGHBOURS = 6  # of a guide, for its share of the area
_AROUND = 0.75  # largest distance of new guides on a partly covered surface, relative to the fourth nearest guide's
_SAME_SIDE = -1.0 / 3.0  # cosine between normals: guides on two sides of an ear do not crowd each other


def difference(settings: CountSettings, weights: np.ndarray) -> int:
    """Return the number of guides that `CountSettings` add, negative to remove; weights (G,): for a factor."""
    if settings.method == "COUNT":
        return settings.guide_count - len(weights)
    return round((settings.factor - 1.0) * float(weights.sum()))


def new_roots(
    mesh: TriMesh,
    roots: SurfacePoints,
    count: int,
    around: np.ndarray,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    device: str = "cpu",
) -> SurfacePoints:
    """Return at most `count` new roots, evenly between existing roots.

    around: (G,) bool, roots that new roots may be placed around; density (V,) and texture: of guides; without them, new
    roots are confined to the part of the surface that the existing guides cover.
    """
    within = None
    if density is None and texture is None:
        places = positions(mesh, roots)
        density = placement.coverage.coverage(mesh, places)
        if density is not None:
            within = _AROUND * grooming.guide_copies.nearest(places, places, 5)[1][:, 4]
    return placement.insertion.insert(
        mesh, roots, count, density=density, texture=texture, around=around, within=within, device=device
    )


def grown_between(
    mesh: TriMesh,
    guides: Strands,
    roots: SurfacePoints,
    settings: HairSettings,
    *,
    regions: Sequence[Regions] = (),
    lines: np.ndarray | None = None,
    drawn_on: np.ndarray | None = None,
    is_mirrored: bool = False,
    tie_fractions: np.ndarray | None = None,
    device: str = "cpu",
) -> tuple[np.ndarray, np.ndarray]:
    """Return guides (M, P, 3) float32 [m] at roots (M,), interpolated like hair, and their nearest guides (M,).

    The nearest guides are in the same region. Other arguments as in `groom.bind_hair`.
    """
    binding = groom.bind_hair(
        mesh,
        guides,
        settings,
        regions=regions,
        lines=lines,
        drawn_on=drawn_on,
        roots=roots,
        is_mirrored=is_mirrored,
        tie_fractions=tie_fractions,
        device=device,
    )
    nearest = np.maximum(binding.guide_weights.indices.numpy()[:, 0], 0)
    return following.follow_guides(binding, guides).numpy(), nearest


def most_crowded(
    roots: np.ndarray, normals: np.ndarray, count: int, may_go: np.ndarray, spread: np.ndarray | None = None
) -> np.ndarray:
    """Return the indices (count,) of guides to remove, in order, for an even rest: sample elimination [Yuksel15].

    roots (G, 3) [m]; normals (G, 3): unit; may_go: (G,) bool, guides that may be removed; spread: (G,) positive,
    wanted density of guides at each root, None for uniform. Returns fewer indices if not enough guides may be removed.
    """
    roots = np.asarray(roots, np.float64)
    count = min(count, int(np.count_nonzero(may_go)))
    if count <= 0:
        return np.zeros(0, np.int64)
    left = max(int(np.count_nonzero(may_go)) - count, 1)
    radius = _largest_spacing(roots, np.count_nonzero(may_go) / left)
    first, second, apart = _pairs(roots, radius)
    is_crowding = np.sum(normals[first] * normals[second], axis=1) > _SAME_SIDE
    first, second, apart = first[is_crowding], second[is_crowding], apart[is_crowding]
    if spread is not None:
        density = np.asarray(spread, np.float64) / np.mean(spread)
        apart = apart * np.sqrt(0.5 * (density[first] + density[second]))
    weights = np.maximum(1.0 - apart / radius, 0.0) ** _POWER
    starts = np.searchsorted(first, np.arange(len(roots) + 1))
    crowding = np.bincount(first, weights, minlength=len(roots))
    heap = [(-crowding[guide], guide) for guide in np.flatnonzero(may_go)]
    heapq.heapify(heap)
    is_gone, removed = np.zeros(len(roots), bool), []
    while len(removed) < count:
        value, guide = heapq.heappop(heap)
        if is_gone[guide] or -value != crowding[guide]:
            continue  # an outdated entry
        is_gone[guide] = True
        removed.append(guide)
        for pair in range(starts[guide], starts[guide + 1]):
            other = second[pair]
            crowding[other] -= weights[pair]
            if may_go[other] and not is_gone[other]:
                heapq.heappush(heap, (-crowding[other], other))
    return np.array(removed, np.int64)


def _largest_spacing(roots, thinning):
    """Return the largest possible spacing [m] after thinning by a factor, from the present area of each guide."""
    count = min(_NEIGHBOURS, len(roots) - 1)
    if count < 1:
        return 1.0
    apart = np.array([np.partition(np.sum((roots - root) ** 2, axis=1), count)[count] for root in _some(roots)])
    area = np.pi * float(np.median(apart)) / count * thinning
    return max(2.0 * np.sqrt(area / (2.0 * np.sqrt(3.0))), 1e-12)


def _some(roots):
    """Return evenly chosen roots, about a thousand: enough for a median."""
    return roots[:: max(len(roots) // 1000, 1)]


def _pairs(places, radius):
    """Return ordered pairs of places (N, 3) within a radius: (Q,) first, ascending, (Q,) second, (Q,) distances."""
    cells = np.floor((places - places.min(axis=0)) / radius).astype(np.int64) + 1
    row, plane = cells[:, 0].max() + 2, (cells[:, 0].max() + 2) * (cells[:, 1].max() + 2)
    keys = cells @ np.array([1, row, plane])
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    firsts, seconds = [], []
    for z in (-plane, 0, plane):
        for y in (-row, 0, row):
            # Three cells in a row have consecutive keys.
            low = np.searchsorted(ranked, keys + z + y - 1, "left")
            sizes = np.searchsorted(ranked, keys + z + y + 1, "right") - low
            within = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
            firsts.append(np.repeat(np.arange(len(places)), sizes))
            seconds.append(order[np.repeat(low, sizes) + within])
    first, second = np.concatenate(firsts), np.concatenate(seconds)
    apart = np.linalg.norm(places[first] - places[second], axis=1)
    is_near = (apart < radius) & (first != second)
    first, second, apart = first[is_near], second[is_near], apart[is_near]
    ranked = np.lexsort((second, first))
    return first[ranked], second[ranked], apart[ranked]
