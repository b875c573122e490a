# SPDX-License-Identifier: GPL-3.0-or-later
"""Lookup tables of shaders, for one fiber and for many."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        absorption_slices,
        albedo,
        cell_means,
        dual_scattering,
        look_tables,
        lookup_tables,
        radial_tables,
        strand_tables,
        surface_albedo,
        table_axes,
        texel_kernels,
    )
else:
    __getattr__ = submodules(__name__)
