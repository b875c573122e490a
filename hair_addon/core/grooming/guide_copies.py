# SPDX-License-Identifier: GPL-3.0-or-later
"""Copying of guide shapes to other guides, rotated with the surface."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..geometry.mirror import Mirror
from ..geometry.search import hash_grid
from ..geometry.strands import lengths as lengths_of
from .guide_shapes import blended, only, rotations, unit
from .guide_tool_settings import CopySettings

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
    """Return indices (M, count) of the places (G, 3) [m] nearest to other places (M, 3), and distances [m]; G > 0."""
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


_UPRIGHT = 0.2  # least sine of the angle between normal and vertical that defines an upward direction on the surface


@dataclass(frozen=True)
class Places:
    """Roots (N, 3) [m] of guides and unit normals (N, 3) of the surface."""

    roots: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class Matches:
    """The guides to copy for T targets: sources (T,) indices, and matrices (T, 3, 3) that rotate or mirror them."""

    sources: np.ndarray
    matrices: np.ndarray


def matched(sources: Places, targets: Places, mapping: str, mirror: Mirror) -> Matches:
    """Return the `Matches` of targets by a `CopySettings.mapping`; mirror: for MIRRORED.

    FITTED aligns center, mean normal and size of the targets with the sources. Shapes are rotated by the least rotation
    between the normals that preserves the upward direction, where the surface is steep enough to define one.
    """
    roots, normals = (np.asarray(array, np.float64) for array in (targets.roots, targets.normals))
    reflection = np.eye(3)
    if mapping == "MIRRORED":
        reflection = mirror.matrix
        roots = mirror.image(roots)
    elif mapping == "FITTED":
        turn = upright_rotations(_mean_normal(sources.normals), _mean_normal(normals))[0]
        (middle, size), (its_middle, its_size) = _extent(roots), _extent(np.asarray(sources.roots, np.float64))
        scale = its_size / size if size > 0.0 else 1.0
        roots = its_middle + scale * (roots - middle) @ turn
    found = nearest(sources.roots, roots)[0][:, 0]
    # Normals transform by the inverse transpose; a reflection is its own inverse.
    reflected = unit(np.asarray(sources.normals, np.float64)[found] @ reflection)
    return Matches(found, upright_rotations(reflected, normals) @ reflection)


def copied(
    points: np.ndarray, sources: np.ndarray, matrices: np.ndarray, settings: CopySettings, weights: np.ndarray
) -> np.ndarray:
    """Return guides (T, P, 3) float32 [m] with the shapes of other guides and their own roots.

    points (T, P, 3) [m]; sources (T, P, 3) [m]: the guide to copy for each; matrices (T, 3, 3); weights (T,) in [0, 1].
    """
    sources = np.asarray(sources, np.float64)
    arms = np.einsum("tij,tpj->tpi", matrices, sources - sources[:, :1])
    if not settings.copy_length:
        its, own = lengths_of(arms), lengths_of(np.asarray(points, np.float64))
        arms *= np.where(its > 0.0, own / np.where(its > 0.0, its, 1.0), 1.0)[:, None, None]
    shares = settings.amount * np.asarray(weights, np.float64)
    return only(points, blended(points, points[:, :1] + arms, shares), shares)


def upright_rotations(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) that map unit normals (N, 3) to other normals, and upward tangents to upward tangents.

    They are the least rotations where either surface is nearly level.
    """
    least = rotations(start, end)
    up = np.array([0.0, 0.0, 1.0])
    before, after = (np.broadcast_to(up, n.shape) - n[:, 2:] * n for n in (start, end))
    is_steep = (np.linalg.norm(before, axis=1) > _UPRIGHT) & (np.linalg.norm(after, axis=1) > _UPRIGHT)
    carried = unit(np.einsum("nij,nj->ni", least, before))
    after = unit(after)
    # A rotation about the end's normal, to which both tangents are perpendicular.
    cosine = np.sum(carried * after, axis=1)
    sine = np.sum(np.cross(carried, after) * end, axis=1)
    angle = np.where(is_steep, np.arctan2(sine, cosine), 0.0)
    return _about(end, angle) @ least


def _about(axes, angles):
    """Return rotations (N, 3, 3) about unit axes (N, 3) by angles (N,) [rad]  (Rodrigues)."""
    cross = np.zeros((len(axes), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -axes[:, 2], axes[:, 1], -axes[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    angles = angles[:, None, None]
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * cross @ cross


def _mean_normal(normals):
    """Return the unit mean normal (1, 3); +Z if normals cancel."""
    mean = unit(np.asarray(normals, np.float64).sum(axis=0, keepdims=True))
    return mean if mean.any() else np.array([[0.0, 0.0, 1.0]])


def _extent(roots):
    """Return the center (3,) of roots and their root mean square distance from it."""
    middle = roots.mean(axis=0)
    return middle, float(np.sqrt(np.mean(np.sum((roots - middle) ** 2, axis=1))))
