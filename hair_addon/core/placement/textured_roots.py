# SPDX-License-Identifier: GPL-3.0-or-later
"""Random roots by density × image × area."""

import numpy as np

from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, interpolate
from ..geometry.sampling import check_density, corner_masses, sample_surface
from .domain import Parts, cut

PIECE_COUNT = 10_000  # least number of pieces of a surface: details that are finer than a piece are missed
EDGE_FINENESS = 2.0  # refinement of pieces in which the mask varies
LONGEST_EDGE = 1.5  # of a piece, relative to the square root of its share of the area


def sample_textured(
    mesh: TriMesh, count: int, seed: int, density: np.ndarray | None, texture: Texture
) -> SurfacePoints:
    """Return `count` random `SurfacePoints` distributed as density × texture × area; arguments as in `sample_surface`.

    Triangles are cut into pieces in which density × texture is taken as linear.
    """
    density = check_density(mesh, density)

    def mask(parts):
        """Return density × image (Q, 3) at the corners of `Parts`."""
        corners = SurfacePoints(np.repeat(parts.triangle, 3).astype(np.int32), _flat(parts.barycentric))
        values = interpolate(density, mesh, corners) * np.maximum(texture.at(corners), 0.0)
        return values.reshape(-1, 3)

    def fineness(parts):
        return np.where(np.ptp(mask(parts), axis=1) > 0.0, EDGE_FINENESS**2, 1.0)

    grown = np.flatnonzero((mesh.areas > 0.0) & corner_masses(mesh, density).any(axis=1))
    whole = Parts(grown, np.broadcast_to(np.eye(3), (len(grown), 3, 3)), mesh.corners[grown], mesh.areas[grown])
    extent = float(np.ptp(_flat(whole.corners), axis=0).max())
    # The lower limit keeps slivers from being cut into pieces of their width.
    spacing = max(np.sqrt(whole.areas.sum() / PIECE_COUNT), 8.0 * extent / PIECE_COUNT)
    parts = cut(whole, LONGEST_EDGE * spacing, fineness)
    vertices = _flat(parts.corners)
    pieces = TriMesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))
    found = sample_surface(pieces, count, seed, mask(parts).ravel())
    barycentric = np.einsum("nc,nck->nk", found.barycentric, parts.barycentric[found.triangle])
    return SurfacePoints(parts.triangle[found.triangle].astype(np.int32), barycentric.astype(np.float32))


def _flat(corners):
    """Return corners (Q, 3, 3) as rows (3 Q, 3) float32."""
    return np.ascontiguousarray(corners, np.float32).reshape(-1, 3)
