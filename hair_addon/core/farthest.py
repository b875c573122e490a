# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that are far from each other, each the farthest from all before [Gonzalez85]."""

import numpy as np
import warp as wp

from .mesh import positions

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def farthest(ground, points, squares, wanted):
    """Indices of `SurfacePoints` of a `Ground`, each as far as can be from all sites and those before.

    squares (Q,) of distances from sites, which count by the spacing that sites should have there; wanted (islands,):
    how many each island is to have. They are fewer where points end.
    """
    islands, densities = ground.islands[points.triangle], ground.density_at(points)
    widths = np.where(wanted[islands] > 0, squares * densities, -1.0)
    # One chain of dependent steps, which only a processor takes quickly.
    places, normals = (
        wp.array(vectors, dtype=wp.vec3, device="cpu")
        for vectors in (positions(ground.mesh, points), ground.normals[points.triangle])
    )
    densities, widths = (wp.array(numbers, dtype=float, device="cpu") for numbers in (densities, widths))
    islands, wanted = (wp.array(numbers, dtype=int, device="cpu") for numbers in (islands, wanted))
    found = wp.full(min(len(points), int(wanted.numpy().sum())), -1, dtype=int, device="cpu")
    inputs = [places, normals, densities, islands]
    wp.launch(_take_farthest, 1, inputs, [widths, wanted, found], device="cpu")
    found = found.numpy()
    return found[found >= 0]


@wp.kernel
def _take_farthest(
    places: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    densities: wp.array[float],
    islands: wp.array[int],
    # outputs; widths hold how wide the gaps are to begin with, and wanted how many points each island is to have
    out_widths: wp.array[float],
    out_wanted: wp.array[int],
    out_found: wp.array[int],
):
    best = int(0)
    for point in range(places.shape[0]):
        if out_widths[point] > out_widths[best]:
            best = point
    for rank in range(out_found.shape[0]):
        if out_widths[best] <= 0.0:
            return
        out_found[rank] = best
        island = islands[best]
        out_wanted[island] = out_wanted[island] - 1
        place = places[best]
        normal = normals[best]
        best = int(0)
        widest = float(-1.0)
        for point in range(places.shape[0]):
            width = out_widths[point]
            if width > 0.0 and islands[point] == island:
                if out_wanted[island] == 0:
                    width = -1.0
                else:
                    closer = densities[point] * wp.length_sq(places[point] - place)
                    # Not on the other side of a thin part.
                    if closer < width and wp.dot(normals[point], normal) > 0.0:
                        width = closer
                out_widths[point] = width
            if width > widest:
                widest = width
                best = point
