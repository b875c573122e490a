# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide distribution: centroidal Voronoi tessellation of a surface  ([Report12] section 2.3)."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        coverage,
        cvt,
        densities,
        domain,
        exact_cells,
        farthest,
        insertion,
        lbfgs,
        preconditioner,
        sampled_cells,
        textured_roots,
        voronoi,
    )
else:
    __getattr__ = submodules(__name__)
