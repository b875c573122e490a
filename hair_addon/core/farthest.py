# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that are far from each other, each the farthest from all before [Gonzalez85].

One chain of dependent steps, which only a processor takes quickly, eight points at once in its vector registers.
"""

import numpy as np
import warp as wp

from .mesh import positions

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

LANES = 8


def farthest(ground, points, squares, wanted):
    """Indices of `SurfacePoints` of a `Ground`, each as far as can be from all sites and those before.

    squares (Q,) of distances from sites, which count by the spacing that sites should have there; wanted (islands,):
    how many each island is to have. They are fewer where points end.
    """
    count = len(points)
    islands, densities = ground.islands[points.triangle], ground.density_at(points)
    widths = np.where(wanted[islands] > 0, squares * densities, -1.0)
    known = np.zeros((8, -(-count // LANES) * LANES), np.float32)
    known[0:3, :count] = positions(ground.mesh, points).T
    known[3:6, :count] = ground.normals[points.triangle].T
    known[6, :count], known[7] = densities, -1.0
    known[7, :count] = widths
    found = np.full(min(count, int(wanted.sum())), -1, np.int32)
    its_islands = np.full(known.shape[1], -1, np.int32)
    its_islands[:count] = islands
    arrays = (known, float), (its_islands, int), (wanted.astype(np.int32), int), (found, int)
    there = [wp.array(values, dtype=kind, device="cpu", copy=False) for values, kind in arrays]
    wp.launch(_take_farthest, 1, there, device="cpu")
    return found[found >= 0]


_TAKE = f"""
#if !defined(__CUDA_ARCH__)
  typedef float lanes __attribute__((ext_vector_type({LANES})));
  typedef int ints __attribute__((ext_vector_type({LANES})));
  const int count = islands.shape[0];
  float* row[8];  // places, normals, densities, and how wide the gaps are
  for (int i = 0; i < 8; ++i) row[i] = known.data + size_t(i) * count;
  float* width_of = row[7];
  int best = 0;
  for (int point = 1; point < count; ++point) best = width_of[point] > width_of[best] ? point : best;
  for (int rank = 0; rank < found.shape[0] && width_of[best] > 0.0f; ++rank) {{
    found.data[rank] = best;
    const int island = islands.data[best];
    const bool is_full = --wanted.data[island] == 0;
    float own[6];
    for (int i = 0; i < 6; ++i) own[i] = row[i][best];
    lanes widest = -1.0f;
    ints where = 0;
    ints index = {{0, 1, 2, 3, 4, 5, 6, 7}};
    for (int point = 0; point < count; point += {LANES}, index += {LANES}) {{
      lanes its[8];
      for (int i = 0; i < 8; ++i) __builtin_memcpy(&its[i], row[i] + point, sizeof(lanes));
      ints its_island;
      __builtin_memcpy(&its_island, islands.data + point, sizeof(ints));
      const lanes x = its[0] - own[0], y = its[1] - own[1], z = its[2] - own[2];
      const lanes closer = its[6] * (x * x + y * y + z * z);
      // Not on the other side of a thin part.
      const ints is_facing = its[3] * own[3] + its[4] * own[4] + its[5] * own[5] > 0.0f;
      const lanes left = is_full ? lanes(-1.0f) : (is_facing & (closer < its[7])) ? closer : its[7];
      const lanes width = ((its[7] > 0.0f) & (its_island == island)) ? left : its[7];
      __builtin_memcpy(width_of + point, &width, sizeof(lanes));
      const ints is_wider = width > widest;
      widest = is_wider ? width : widest;
      where = is_wider ? index : where;
    }}
    best = where[0];
    float most = widest[0];
    for (int lane = 1; lane < {LANES}; ++lane) {{
      // Of two as wide the first.
      const bool is_before = widest[lane] > most || (widest[lane] == most && where[lane] < best);
      most = is_before ? widest[lane] : most;
      best = is_before ? where[lane] : best;
    }}
  }}
#endif
"""


@wp.func_native(_TAKE)
def _take(known: wp.array2d[float], islands: wp.array[int], wanted: wp.array[int], found: wp.array[int]): ...


@wp.kernel
def _take_farthest(
    known: wp.array2d[float],
    islands: wp.array[int],
    wanted: wp.array[int],
    # outputs
    found: wp.array[int],
):
    _take(known, islands, wanted, found)
