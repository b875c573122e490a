# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirroring of guides: those of one side are replaced with images of the other side's."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry import hash_grid
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.mirror import Mirror

_EVERYWHERE = 1e15  # [m]: a distance to search that leaves nothing out
_MIDDLE = 0.1  # of the distance between guides: nearer to the plane than this, they are on it
_OFF = 0.05  # of the surface's size: farther from it, a mirrored place has no surface


@dataclass(frozen=True)
class Mirroring:
    """Of G guides: removed (R,) indices; sources (M,) indices of those with images, and the images' M roots."""

    removed: np.ndarray
    sources: np.ndarray
    roots: SurfacePoints


def nearest(places: np.ndarray, others: np.ndarray, count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(M, count) indices of places (G, 3) [m] nearest to others (M, 3) [m], and their distances [m]; G > 0."""
    own, other = (wp.array(np.ascontiguousarray(a, np.float32), dtype=wp.vec3, device="cpu") for a in (places, others))
    indices, distances = hash_grid.neighbours(own, other, _EVERYWHERE, count)
    return indices.numpy(), distances.numpy()


def mirroring(mesh: TriMesh, roots: np.ndarray, mirror: Mirror, chosen: np.ndarray) -> Mirroring:
    """Which guides of the side that a mirror's normal points to have images, and which of the other side these replace.

    mesh: checked; roots (G, 3) [m]; chosen: (G,) bool, of which guides only images are made: they replace the guides
    whose mirrored places are nearest to chosen ones. Guides on the plane stay. Raises `HairError` where nothing can be
    mirrored.
    """
    heights = np.asarray(roots, np.float64) @ mirror.normal
    # By the side that stays: mirroring twice is mirroring once.
    on_side, middle = roots[heights > 0.0], 0.0
    if len(on_side) > 1:
        middle = _MIDDLE * float(np.median(nearest(on_side, on_side, 2)[1][:, 1]))
    of_side, of_other = np.flatnonzero(heights > middle), np.flatnonzero(heights < -middle)
    sources = of_side[chosen[of_side]]
    if not len(sources):
        raise HairError("There are no guides to mirror on this side: choose the other direction, or other guides.")
    images = mirror.image(np.asarray(roots, np.float64)[sources])
    found = SurfaceQuery(mesh).nearest(images)
    apart = np.linalg.norm(positions(mesh, found) - images, axis=1)
    is_there = apart < _OFF * float(np.ptp(mesh.vertices, axis=0).max())
    if not is_there.any():
        raise HairError("The surface has no other side to mirror guides to: check the object's origin.")
    replaced = np.zeros(0, bool)
    if len(of_other):
        counterparts = of_side[nearest(roots[of_side], mirror.image(roots[of_other].astype(np.float64)))[0][:, 0]]
        replaced = chosen[counterparts]
    return Mirroring(of_other[replaced], sources[is_there], found[is_there])


def images(
    mesh: TriMesh, points: np.ndarray, roots: SurfacePoints, image_roots: SurfacePoints, mirror: Mirror
) -> np.ndarray:
    """(M, P, 3) float32 [m]: mirrored guides at their new roots; points (M, P, 3) [m] of guides rooted at `roots`."""
    arms = np.asarray(points, np.float64) - positions(mesh, roots).astype(np.float64)[:, None]
    mirrored = mirror.image(arms.reshape(-1, 3)).reshape(arms.shape)
    return (positions(mesh, image_roots).astype(np.float64)[:, None] + mirrored).astype(np.float32)
