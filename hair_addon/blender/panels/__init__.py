# SPDX-License-Identifier: GPL-3.0-or-later
"""The Hair tab of the N-panel: the pipeline in order. Layout, nothing else."""

from . import guides, interpolation, output, rendering, shading, surface, tables

CLASSES = (
    *surface.CLASSES,
    *guides.CLASSES,
    *interpolation.CLASSES,
    *shading.CLASSES,
    *tables.CLASSES,
    *output.CLASSES,
    *rendering.CLASSES,
)
