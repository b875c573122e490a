# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among strands: paths from the viewer through a grid of fibers, and their means by voxel.

The kernels run on CPU, on CUDA and, translated by `core/kernels/glsl_text.py`, on any GPU: they use only features that
the translation supports (`tests/test_metal.py` translates all kernels).
"""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        fibre_walk,
        gather,
        grid_walk,
        lamp_light,
        light_sources,
        light_texels,
        media,
        row_sums,
        seen_rays,
        start_density,
        start_places,
        strand_cells,
        strand_grid,
        strand_nodes,
        surface_walk,
        view,
        voxel_means,
        voxel_sums,
        world_light,
    )
else:
    __getattr__ = submodules(__name__)
