# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides: neighbors, weights and weighted sums  ([Report12] section 2.4)."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        carried_strands,
        clump_centers,
        cpu_weights,
        guide_fitting,
        guide_regions,
        guide_weights,
        hair_binding,
        interpolation,
        part_lines,
        regions,
        root_binder,
    )
else:
    __getattr__ = submodules(__name__)
