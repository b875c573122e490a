# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirroring of guides: guides of one side are replaced with images of those on the other side."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry import hash_grid
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.mirror import Mirror

_EVERYWHERE = 1e15  # [m]: an unlimited search distance
_MIDDLE = 0.1  # largest distance of guides that count as on the plane, relative to the spacing of guides
_OFF = 0.05  # largest distance of a mirrored place from the surface, relative to the surface's size


@dataclass(frozen=True)
class Mirroring:
    """Indices removed (R,) of replaced guides and sources (M,) of guides with images; roots of the M images."""

    removed: np.ndarray
    sources: np.ndarray
    roots: SurfacePoints


def nearest(places: np.ndarray, others: np.ndarray, count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return indices (M, count) of the places (G, 3) [m] nearest to others (M, 3) [m], and distances [m]; G > 0."""
    own, other = (wp.array(np.ascontiguousarray(a, np.float32), dtype=wp.vec3, device="cpu") for a in (places, others))
    indices, distances = hash_grid.neighbours(own, other, _EVERYWHERE, count)
    return indices.numpy(), distances.numpy()


def mirroring(mesh: TriMesh, roots: np.ndarray, mirror: Mirror, chosen: np.ndarray) -> Mirroring:
    """Return the guides on the side of a mirror's normal that get images, and the guides that these replace.

    mesh: checked; roots (G, 3) [m]; chosen: (G,) bool, guides to mirror; images replace the guides whose mirrored
    places are nearest to chosen ones. Guides on the plane are kept. Raises `HairError` if nothing can be mirrored.
    """
    heights = np.asarray(roots, np.float64) @ mirror.normal
    # Measured on the side that is kept, so that mirroring is idempotent.
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
    is_on_surface = apart < _OFF * float(np.ptp(mesh.vertices, axis=0).max())
    if not is_on_surface.any():
        raise HairError("The surface has no other side to mirror guides to: check the object's origin.")
    replaced = np.zeros(0, bool)
    if len(of_other):
        counterparts = of_side[nearest(roots[of_side], mirror.image(roots[of_other].astype(np.float64)))[0][:, 0]]
        replaced = chosen[counterparts]
    return Mirroring(of_other[replaced], sources[is_on_surface], found[is_on_surface])


def images(
    mesh: TriMesh, points: np.ndarray, roots: SurfacePoints, image_roots: SurfacePoints, mirror: Mirror
) -> np.ndarray:
    """Return mirrored guides (M, P, 3) float32 [m] at new roots; points (M, P, 3) [m]: of guides rooted at `roots`."""
    arms = np.asarray(points, np.float64) - positions(mesh, roots).astype(np.float64)[:, None]
    mirrored = mirror.image(arms.reshape(-1, 3)).reshape(arms.shape)
    return (positions(mesh, image_roots).astype(np.float64)[:, None] + mirrored).astype(np.float32)
