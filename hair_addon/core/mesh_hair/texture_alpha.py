# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands along the opaque parts of textures, which end where a texture becomes transparent."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..errors import HairError
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..long_work import Progress
from . import alpha_paths, card_lines
from .card_lines import LEAST_SHOWN, ROWS, Card, Lines
from .mesh_strands import MeshStrands

HIDDEN = "The texture of the hair mesh is transparent at all strands: turn off Use Alpha."

_OPAQUE = 0.5  # alpha above which a texture shows hair
_HALVINGS = 4  # bisections of the segment in which a texture ends
_CELLS, _FEWEST, _MOST = 2, 64, 256  # cells per strand in a row, and the smallest and largest number of cells
_BATCH = 1 << 15  # largest number of cells in a row of the cards that are followed together
_STEEP = 1.0  # sideways movement of the border of an opaque part, relative to the distance of rows: 45 degrees


def follow(
    cards: list[Card], mesh: TriMesh, fills: bool, alpha_at: Callable[[SurfacePoints], np.ndarray], progress: Progress
) -> None:
    """Replace the lines of cards with transparent parts by lines along the opaque parts."""
    groups: dict[int, list[Card]] = {}
    for card in cards:
        cells = 1 << int(np.ceil(np.log2(_CELLS * card.count)))
        groups.setdefault(min(max(cells, _FEWEST), _MOST), []).append(card)
    done = 0
    for cells, group in groups.items():
        size = max(_BATCH // cells, 1)
        for first in range(0, len(group), size):
            progress("Following textures", done / len(cards))
            some = group[first : first + size]
            _follow_some(some, cells, mesh, fills, alpha_at)
            done += len(some)


def _follow_some(cards, cells, mesh, fills, alpha_at):
    """Replace the lines of cards, each with rows of some number of cells."""
    across, along = (np.arange(cells) + 0.5) / cells, (np.arange(ROWS) + 0.5) / ROWS
    shape = len(cards), ROWS, cells
    layouts = {id(card.chart): card for card in cards}
    on_layouts = card_lines.located(
        [card.flat for card in layouts.values()],
        [card.chart.queries(across[None], along[:, None]) for card in layouts.values()],
    )
    grids = dict(zip(layouts, on_layouts, strict=True))
    places = SurfacePoints(
        np.concatenate([card.faces[grids[id(card.chart)][0]] for card in cards]).astype(np.int32),
        np.concatenate([grids[id(card.chart)][1] for card in cards]),
    )
    opaque = alpha_at(places).reshape(shape) >= _OPAQUE
    measured = np.arange(len(places)).reshape(shape)[:, :, [0, cells // 2, -1]]
    points = positions(mesh, places[measured.ravel()]).astype(np.float64).reshape(len(cards), ROWS, 3, 3)
    widths = np.linalg.norm(points[:, 1:, 2] - points[:, 1:, 0], axis=2) / (cells - 1)
    steps = np.linalg.norm(np.diff(points[:, :, 1], axis=1), axis=2)
    steepness = np.maximum(_STEEP * steps / np.maximum(widths, 1e-30), 1.0)
    is_shown = opaque.any(axis=(1, 2))
    for card, is_any in zip(cards, is_shown, strict=True):
        if not is_any:
            card.lines = Lines.none()
    chosen = np.flatnonzero(is_shown & ~opaque.all(axis=(1, 2)))
    if not len(chosen):
        return
    owners = np.repeat(np.arange(len(chosen)), [cards[place].count for place in chosen])
    starts = np.concatenate([cards[place].across for place in chosen])
    paths = alpha_paths.traced(opaque[chosen], steepness[chosen], owners, starts)
    if not fills:  # strands that fill a card reach the borders of its opaque parts
        paths = alpha_paths.inside(paths, opaque[chosen], owners)
    for number, place in enumerate(chosen):
        cards[place].lines = card_lines.lines_along(cards[place].chart, cards[place].widths, paths, owners == number)


def shown(
    strands: MeshStrands, alpha: np.ndarray, alpha_at: Callable[[SurfacePoints], np.ndarray], mesh: TriMesh
) -> MeshStrands:
    """Return strands that end where a texture becomes transparent, without mostly transparent strands.

    alpha: (N,) in [0, 1] at the points; alpha_at: a function that returns it at places on the hair mesh. Raises
    `HairError` if no strand is left.
    """
    is_shown, starts = alpha >= _OPAQUE, strands.starts[:-1]
    place = np.arange(len(alpha)) - np.repeat(starts, strands.counts)
    last = np.maximum.reduceat(np.where(is_shown, place, -1), starts)
    parts = np.add.reduceat(is_shown.astype(np.float64), starts) / strands.counts
    last[parts < LEAST_SHOWN] = -1
    is_cut = (last >= 0) & (last < strands.counts - 1)
    cut = _cut(strands, (starts + last)[is_cut], alpha_at, mesh)
    found = cut.some(place <= np.repeat(last + is_cut, strands.counts))
    if not len(found.counts):
        raise HairError(HIDDEN)
    return found


def _cut(strands, rows, alpha_at, mesh):
    """Return strands with the points after `rows` (M,) moved back to the end of the texture.

    Between two points, the plane and the UV coordinates of the first point's triangle are extended.
    """
    first, second = (strands.points[at].astype(np.float64) for at in (rows, rows + 1))
    triangle = strands.places.triangle[rows]
    corners = mesh.vertices.astype(np.float64)[mesh.triangles[triangle]]
    axes = corners[:, 1:] - corners[:, :1]
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    barycentric = strands.places.barycentric[rows].astype(np.float64)
    across = np.einsum("mki,mji->mkj", axes, axes)
    shares = np.einsum("mki,mi->mk", axes, second - first)
    steps = np.einsum("mkj,mj->mk", np.linalg.pinv(across, hermitian=True), shares)
    steps = np.concatenate([-steps.sum(axis=1, keepdims=True), steps], axis=1)
    for _halving in range(_HALVINGS):
        middle = 0.5 * (low + high)
        places = SurfacePoints(triangle, (barycentric + middle[:, None] * steps).astype(np.float32))
        is_opaque = alpha_at(places) >= _OPAQUE
        low, high = np.where(is_opaque, middle, low), np.where(is_opaque, high, middle)
    points, radii = strands.points.copy(), strands.radii.copy()
    triangles, weights = strands.places.triangle.copy(), strands.places.barycentric.copy()
    # A minimum distance, so that no segment has zero length.
    low = np.maximum(low, 0.5**_HALVINGS)
    points[rows + 1] = first + low[:, None] * (second - first)
    radii[rows + 1] = strands.radii[rows] + low * (strands.radii[rows + 1] - strands.radii[rows])
    triangles[rows + 1], weights[rows + 1] = triangle, strands.places.barycentric[rows]  # an opaque place
    return replace(strands, points=points, radii=radii, places=SurfacePoints(triangles, weights))
