# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest points on a surface, by Warp's bounding volume hierarchy."""

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows
from .mesh import SurfacePoints, TriMesh

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


FARTHEST = 1.0e15  # [m]: the square of this distance does not overflow


class SurfaceQuery:
    """Closest-point queries on a `TriMesh` with finite vertices, or on some of its triangles.

    Triangles of zero area are ignored. Raises `HairError` if no triangle is left.
    """

    def __init__(self, mesh: TriMesh, triangles: np.ndarray | None = None, device: wp.DeviceLike = "cpu") -> None:
        """triangles: indices of the triangles to query, None for all."""
        chosen = np.arange(len(mesh.triangles)) if triangles is None else np.asarray(triangles)
        # Warp's queries fail on triangles that degenerate to points.
        self._triangles = chosen[mesh.areas[chosen] > 0.0].astype(np.int32)
        if not len(self._triangles) or not np.isfinite(mesh.vertices).all():
            raise HairError("The surface has no faces with an area, or vertices with non-finite coordinates.")
        # For kernels; its faces are the queried triangles.
        self.mesh = wp.Mesh(
            points=wp.array(mesh.vertices, dtype=wp.vec3, device=device),
            indices=wp.array(mesh.checked_triangles[self._triangles].ravel(), dtype=int, device=device),
        )

    def nearest(self, places: np.ndarray, farthest: np.ndarray | None = None) -> SurfacePoints:
        """Return the closest `SurfacePoints` to finite positions (N, 3) [m].

        farthest: (N,) [m] upper bounds of the distances, which speed up the search; None if unknown.
        """
        device = self.mesh.device
        if not np.isfinite(places).all():
            raise HairError("The closest points on the surface cannot be found for non-finite coordinates.")
        limits = wp.full(len(places), FARTHEST, dtype=float, device=device)
        if farthest is not None:
            require_count("distances", len(farthest), len(places))
            limits = wp.array(farthest, dtype=float, device=device)
        places = wp.array(places.astype(np.float32), dtype=wp.vec3, device=device)
        faces = wp.empty(len(places), dtype=int, device=device)
        barycentric = wp.empty(len(places), dtype=wp.vec3, device=device)
        parallel.launch(
            _nearest,
            len(places),
            inputs=[self.mesh.id, Rows(places), Rows(limits)],
            outputs=[faces, barycentric],
            device=device,
            least_rows=1024,
        )
        return SurfacePoints(self._triangles[faces.numpy()], barycentric.numpy())


@wp.func
def normal_and_offset(
    surface: wp.uint64, vertex_normals: wp.array[wp.vec3], face: int, u: float, v: float, place: wp.vec3
):
    """Return (unit normal at a point of a face, vector from the point to `place` [m]); vertex_normals: (V,) unit."""
    indices = wp.mesh_get(surface).indices
    normal = wp.normalize(
        u * vertex_normals[indices[3 * face]]
        + v * vertex_normals[indices[3 * face + 1]]
        + (1.0 - u - v) * vertex_normals[indices[3 * face + 2]]
    )
    return normal, place - wp.mesh_eval_position(surface, face, u, v)


@wp.kernel
def _nearest(
    surface: wp.uint64,
    places: wp.array[wp.vec3],
    farthest: wp.array[float],
    # outputs
    out_faces: wp.array[int],
    out_barycentric: wp.array[wp.vec3],
):
    place = wp.tid()
    query = wp.mesh_query_point_no_sign(surface, places[place], farthest[place])
    out_faces[place] = query.face
    out_barycentric[place] = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
