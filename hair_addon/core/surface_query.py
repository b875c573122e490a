# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest point of a surface, by Warp's bounding volume hierarchy."""

import numpy as np
import warp as wp

from .mesh import SurfacePoints
from .threads import LEAST_SHARE, in_threads, share_count

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


FARTHEST = 1.0e15  # [m]: its square is still a float


class SurfaceQuery:
    """A checked `TriMesh`, or some of its triangles, ready to be asked. Triangles without an area take no part."""

    def __init__(self, mesh, triangles=None, device="cpu"):
        """triangles: indices of those that take part, at least one of them with an area; None for all."""
        chosen = np.arange(len(mesh.triangles)) if triangles is None else np.asarray(triangles)
        # Warp's queries go wrong on triangles that are points.
        self._triangles = chosen[mesh.areas[chosen] > 0.0].astype(np.int32)
        # Kernels query this, whose faces are those of the triangles that take part.
        self.mesh = wp.Mesh(
            points=wp.array(mesh.vertices, dtype=wp.vec3, device=device),
            indices=wp.array(mesh.triangles[self._triangles].ravel(), dtype=int, device=device),
        )

    def nearest(self, places, farthest=None):
        """(N, 3) finite positions [m] → the nearest `SurfacePoints`.

        farthest (N,) [m]: distances within which there is some surface, if they are known: so it is found sooner.
        """
        device = self.mesh.device
        limits = wp.full(len(places), FARTHEST, dtype=float, device=device)
        if farthest is not None:
            limits = wp.array(farthest, dtype=float, device=device)
        places = wp.array(places.astype(np.float32), dtype=wp.vec3, device=device)
        faces = wp.empty(len(places), dtype=int, device=device)
        barycentric = wp.empty(len(places), dtype=wp.vec3, device=device)
        outputs = [[faces, barycentric]] * share_count(len(places), LEAST_SHARE // 4, device)
        in_threads(_nearest, len(places), [self.mesh.id, places, limits], outputs, device)
        return SurfacePoints(self._triangles[faces.numpy()], barycentric.numpy())


@wp.kernel
def _nearest(
    surface: wp.uint64,
    places: wp.array[wp.vec3],
    farthest: wp.array[float],
    first_place: int,
    # outputs
    out_faces: wp.array[int],
    out_barycentric: wp.array[wp.vec3],
):
    place = first_place + wp.tid()
    query = wp.mesh_query_point_no_sign(surface, places[place], farthest[place])
    out_faces[place] = query.face
    out_barycentric[place] = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
