# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer of a saved groom to another surface: choice of the method, and transfer of masks.

A similar copy of the surface takes the guides exactly. Otherwise roots keep their UV coordinates if both surfaces have
UV maps of the same layout; else they move to the nearest surface after alignment of the bounding boxes.
"""

from dataclasses import dataclass

import numpy as np

from .. import geometry
from ..errors import HairError
from ..geometry.landmark_warp import Warp
from ..geometry.mesh import SurfacePoints, TriMesh, interpolate, positions
from . import groom_transfer
from .groom_transfer import Places, TransferSurface

METHODS = ("AUTO", "UV", "NEAREST")

_SAME = 1e-3  # largest deviation of a copy from a similarity, relative to the surface's size
_LEAST_KEPT = 0.9  # least fraction of guides that UV maps of the same layout place
_MOST_STRETCH = 0.25  # largest RMS deviation from a similarity for UV maps that agree, relative to the roots' spread
# Largest distance of a root or a mask from the surface, relative to the surface's size. Bounding boxes of heads with
# large ears or long necks align scalps poorly: guides that lie a little aside are better than bald places.
_REACH = 0.2
_ASIDE = 0.1  # distance of a root from the surface, relative to the surface's size, beyond which it is not in its place
_OUTSIDE = 1e-3  # largest distance of a mask from a UV layout, relative to the layout's size


@dataclass(frozen=True)
class Passage:
    """The `Places` of guides on another surface, and the method of the transfer.

    method: "COPY", "UV" or "NEAREST"; warp: from the source's to the target's space, None for "UV".
    """

    method: str
    places: Places
    warp: Warp | None


def passage(source: TransferSurface, target: TransferSurface, roots: SurfacePoints, method: str = "AUTO") -> Passage:
    """Return the `Passage` of guides with roots (G) on the source; method: one of `METHODS`. Raises `HairError`.

    "AUTO" uses the first method that applies: a copy, UV maps that agree, the nearest surface.
    """
    if method not in METHODS:
        raise HairError(f"method must be one of {', '.join(METHODS)}, not {method}.")
    if method == "UV":
        return Passage("UV", groom_transfer.places_by_uv(source, target, roots), None)
    if method == "AUTO":
        found = _copied(source, target, roots) or _by_agreeing_uv(source, target, roots)
        if found is not None:
            return found
    warp = geometry.landmark_warp.between_boxes(source.mesh.vertices, target.mesh.vertices)
    places = groom_transfer.places_by_warp(source.mesh, target.mesh, roots, warp, _REACH)
    return Passage("NEAREST", places, warp)


def _copied(source, target, roots):
    """Return the `Passage` to a similar mesh with the same triangles; None for another mesh."""
    if not np.array_equal(source.mesh.triangles, target.mesh.triangles):
        return None
    if len(source.mesh.vertices) != len(target.mesh.vertices):
        return None
    warp = Warp(
        *geometry.landmark_warp.similarity(*(m.vertices.astype(np.float64) for m in (source.mesh, target.mesh)))
    )
    apart = np.abs(warp.places(source.mesh.vertices) - target.mesh.vertices).max()
    if not apart <= _SAME * np.ptp(target.mesh.vertices, axis=0).max():  # rejects NaN too
        return None
    return Passage("COPY", groom_transfer.places_by_warp(source.mesh, target.mesh, roots, warp, _REACH), warp)


def _by_agreeing_uv(source, target, roots):
    """Return the `Passage` by UV maps; None if one is missing or the layouts differ."""
    if source.corner_uvs is None or target.corner_uvs is None:
        return None
    try:
        places = groom_transfer.places_by_uv(source, target, roots)
    except HairError:
        return None
    if len(places.kept) < max(_LEAST_KEPT * len(roots), 3):
        return None
    before = positions(source.mesh, roots[places.kept]).astype(np.float64)
    after = positions(target.mesh, places.roots).astype(np.float64)
    warp = Warp(*geometry.landmark_warp.similarity(before, after))
    apart = np.sqrt(np.mean(np.sum((warp.places(before) - after) ** 2, axis=1)))
    spread = np.sqrt(np.mean(np.sum((after - after.mean(axis=0)) ** 2, axis=1)))
    return Passage("UV", places, None) if apart <= _MOST_STRETCH * spread else None


def aside_count(source: TransferSurface, target: TransferSurface, roots: SurfacePoints, found: Passage) -> int:
    """Return how many of the placed guides with roots (G) on the source are far from where the alignment puts them."""
    if found.warp is None:
        return 0
    wanted = found.warp.places(positions(source.mesh, roots[found.places.kept]))
    apart = np.linalg.norm(positions(target.mesh, found.places.roots) - wanted, axis=1)
    return int((apart > _ASIDE * float(np.ptp(target.mesh.vertices, axis=0).max())).sum())


def carried_weights(
    source: TransferSurface, target: TransferSurface, weights: np.ndarray, warp: Warp | None, reach: float = _REACH
) -> np.ndarray:
    """Return masks (W, K) float32 in [0, 1] of the target's W vertices, from masks (V, K) of the source's vertices.

    warp: from the source's to the target's space, None for UV; reach: largest distance of a vertex from the warped
    source, relative to the target's size; masks are 0 beyond this distance.
    """
    if warp is None:
        wanted, mesh = _uv_places(target), _layout(source)
        reach = _OUTSIDE * float(np.ptp(mesh.vertices[:, :2], axis=0).max())
        weights = weights[source.mesh.triangles.ravel()]
    else:
        wanted = target.mesh.vertices
        mesh = TriMesh(warp.places(source.mesh.vertices).astype(np.float32), source.mesh.triangles)
        reach *= float(np.ptp(target.mesh.vertices, axis=0).max())
    nearest = geometry.closest_point.SurfaceQuery(mesh).nearest(wanted)
    is_near = np.linalg.norm(positions(mesh, nearest) - wanted, axis=1) <= reach
    sampled = interpolate(weights.astype(np.float32), mesh, nearest)
    return np.clip(np.where(is_near[:, None], sampled, 0.0), 0.0, 1.0).astype(np.float32)


def _layout(source):
    """Return the UV map as a flat `TriMesh` with separate corners."""
    flat = np.zeros((3 * len(source.corner_uvs), 3), np.float32)
    flat[:, :2] = source.corner_uvs.reshape(-1, 2)
    return TriMesh(flat, np.arange(len(flat), dtype=np.int32).reshape(-1, 3))


def _uv_places(source):
    """Return the UV coordinates (V, 3) float32 of a corner of each vertex, with z = 0; far away for loose vertices."""
    places = np.full((len(source.mesh.vertices), 3), 1e6, np.float32)
    places[source.mesh.triangles.ravel(), :2] = source.corner_uvs.reshape(-1, 2)
    places[source.mesh.triangles.ravel(), 2] = 0.0
    return places
