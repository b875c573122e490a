# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer of guides to another mesh of any topology: new roots by UV, by nearest surface or by landmarks.

The map between the surfaces has a Jacobian J at each root. Guides are rotated by the orthogonal factor of J, which may
be a reflection, and by the least rotation to the normal of the other surface. A rotated, scaled or mirrored copy
thus gets the same groom.
"""

from dataclasses import dataclass

import numpy as np

from .. import geometry
from ..errors import HairError
from ..geometry.landmark_warp import Warp
from ..geometry.mesh import SurfacePoints, TriMesh, check_mesh, check_points, normals, positions
from .guide_shapes import rotations

_OUTSIDE = 1e-3  # tolerance for coordinates outside all faces, relative to the UV layout's size


@dataclass(frozen=True)
class TransferSurface:
    """The source or target mesh of a transfer: `TriMesh` [m] and UV coordinates (F, 3, 2) of its corners, or None."""

    mesh: TriMesh
    corner_uvs: np.ndarray | None = None


@dataclass(frozen=True)
class Places:
    """New roots of M of G guides.

    kept: (M,) ascending indices; roots: M `SurfacePoints`; turns: (M, 3, 3) orthogonal; scale: factor of lengths;
    far_count: guides dropped because no surface is near; other_side_count: guides dropped because the surface there
    faces the other way.
    """

    kept: np.ndarray
    roots: SurfacePoints
    turns: np.ndarray
    scale: float
    far_count: int
    other_side_count: int

    @property
    def lost_count(self) -> int:
        """Number of guides without a place."""
        return self.far_count + self.other_side_count


def places_by_uv(source: TransferSurface, target: TransferSurface, roots: SurfacePoints, scales: bool = True) -> Places:
    """Return `Places` with equal UV coordinates; roots: G `SurfacePoints` of the source.

    scales: whether lengths scale with the surface. Coordinates outside the target's layout have no place; of
    overlapping faces, any may be found. Raises `HairError`.
    """
    _check(source.mesh, target.mesh, roots)
    if source.corner_uvs is None or target.corner_uvs is None:
        raise HairError("A transfer by UV needs a UV map on both meshes: create them, or choose another method.")
    layout, other_layout = _layout(source.corner_uvs), _layout(target.corner_uvs)
    wanted = positions(layout, roots)
    query = geometry.closest_point.SurfaceQuery(other_layout)
    found = query.nearest(wanted)
    apart = np.linalg.norm(positions(other_layout, found) - wanted, axis=1)
    is_near = apart <= _OUTSIDE * float(np.ptp(other_layout.vertices[:, :2], axis=0).max())
    own, has_area = _uv_tangents(source, roots.triangle)
    its, has_its_area = _uv_tangents(target, found.triangle)
    derivatives = its @ np.linalg.inv(own)
    return _placed(source.mesh, target.mesh, (roots, found), derivatives, is_near & has_area & has_its_area, scales)


def places_by_warp(
    source: TriMesh, target: TriMesh, roots: SurfacePoints, warp: Warp, reach: float = 0.05, scales: bool = True
) -> Places:
    """Return the `Places` closest to the roots mapped by a `Warp`; arguments as in `places_by_uv`.

    reach: largest distance of a mapped root from the target, relative to the target's size. Raises `HairError`.
    """
    _check(source, target, roots)
    at_roots = positions(source, roots)
    wanted = warp.places(at_roots)
    farthest = 0.1 * geometry.closest_point.FARTHEST
    if not np.abs(wanted).max() < farthest:  # rejects NaN too
        raise HairError("The meshes cannot be aligned: check their scale and their landmarks.")
    found = geometry.closest_point.SurfaceQuery(target).nearest(wanted)
    apart = np.linalg.norm(positions(target, found) - wanted, axis=1)
    is_near = apart <= reach * float(np.ptp(target.vertices, axis=0).max())
    return _placed(source, target, (roots, found), warp.derivatives(at_roots), is_near, scales)


def carried(
    source: TriMesh, target: TriMesh, roots: SurfacePoints, points: np.ndarray, counts: np.ndarray, places: Places
) -> np.ndarray:
    """Return the transferred points (N, 3) float32 [m] of the guides with `Places`, concatenated.

    roots: `SurfacePoints` of all G guides; points: of all guides [m], with counts (G,). The offset between a guide's
    first point and its surface is transferred as well.
    """
    starts = geometry.strands.curve_offsets(counts)
    if len(counts) != len(roots) or starts[-1] != len(points):
        raise ValueError("counts must be those of the points, one for each root")
    is_kept = np.zeros(len(counts), bool)
    is_kept[places.kept] = True
    kept_counts = np.asarray(counts)[places.kept]
    own = np.repeat(positions(source, roots[places.kept]), kept_counts, axis=0).astype(np.float64)
    arms = np.asarray(points, np.float64)[np.repeat(is_kept, counts)] - own
    turned = places.scale * np.einsum("nij,nj->ni", np.repeat(places.turns, kept_counts, axis=0), arms)
    return (np.repeat(positions(target, places.roots), kept_counts, axis=0) + turned).astype(np.float32)


def _check(source, target, roots):
    for mesh in (source, target):
        check_mesh(mesh)
    check_points(source, roots)


def _layout(corner_uvs):
    """Return a UV layout as a flat `TriMesh` with the same triangles. Raises `HairError`."""
    flat = np.zeros((3 * len(corner_uvs), 3), np.float32)
    flat[:, :2] = corner_uvs.reshape(-1, 2)
    layout = TriMesh(flat, np.arange(len(flat), dtype=np.int32).reshape(-1, 3))
    if not (np.isfinite(flat).all() and np.any(layout.areas > 0.0)):
        raise HairError("A UV map has no area, or non-finite coordinates: unwrap that mesh again.")
    return layout


def _uv_tangents(surface, triangles):
    """Return ((N, 3, 3) columns dP/du, dP/dv and normal [m] of triangles (N,), (N,) bool: whether these span space).

    The normal has the geometric mean length of the tangents, so that it scales with lengths.
    """
    corners, uvs = surface.mesh.corners[triangles], surface.corner_uvs[triangles].astype(np.float64)
    edges, uv_edges = (np.swapaxes(array[:, 1:] - array[:, :1], 1, 2) for array in (corners, uvs))
    areas = np.linalg.det(uv_edges)
    span = np.abs(uv_edges).max(axis=(1, 2))
    scaled = surface.mesh.scaled_normals[triangles]
    doubled = np.linalg.norm(scaled, axis=1)
    has_area = (np.abs(areas) > 1e-9 * span**2) & (doubled > 0.0)
    uv_edges[~has_area], areas[~has_area], doubled[~has_area] = np.eye(2), 1.0, 1.0
    tangents = edges @ np.linalg.inv(uv_edges)
    normal = scaled / doubled[:, None] * np.sqrt(doubled / np.abs(areas))[:, None]
    frames = np.concatenate([tangents, normal[:, :, None]], axis=2)
    frames[~has_area] = np.eye(3)
    return frames, has_area


def _placed(source, target, roots, derivatives, is_near, scales):
    """Return `Places` of the roots (own, found) that are near and face the same side as the mapped surface."""
    own, found = roots
    own_normals, found_normals = (normals(mesh, at).astype(np.float64) for mesh, at in ((source, own), (target, found)))
    left, _values, right = np.linalg.svd(derivatives)
    orthogonal = left @ right
    mapped = np.einsum("nij,nj->ni", orthogonal, own_normals)
    is_alike = np.sum(mapped * found_normals, axis=1) > 0.0
    kept = np.flatnonzero(is_near & is_alike)
    if not len(kept):
        raise HairError("No guide has found a place on the other mesh: choose another method, or a larger reach.")
    turns = rotations(mapped[kept], found_normals[kept]) @ orthogonal[kept]
    scale = 1.0
    if scales:
        scale = float(np.median(_stretches(derivatives[kept], own_normals[kept])))
    return Places(
        kept, found[kept], turns, scale, int(np.count_nonzero(~is_near)), int(np.count_nonzero(is_near & ~is_alike))
    )


def _stretches(derivatives, normals_there):
    """Return the square roots (N,) of a map's area factors perpendicular to unit normals (N, 3)."""
    # |cof(J) n|: the columns of the cofactor matrix are cross products of the columns of J.
    first, second, third = np.moveaxis(derivatives, 2, 0)
    cofactors = np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=2)
    return np.sqrt(np.linalg.norm(np.einsum("nij,nj->ni", cofactors, normals_there), axis=1))
