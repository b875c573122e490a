# SPDX-License-Identifier: GPL-3.0-or-later
"""The Hair tab of the sidebar, in the order of the pipeline: layout only."""

from . import (
    collider,
    dynamics,
    guides,
    interpolation,
    layers,
    output,
    progress,
    rendering,
    shading,
    styles,
    surface,
    systems,
    tables,
)

LISTS = (*systems.LISTS, *layers.LISTS, *styles.LISTS)

CLASSES = (
    *progress.CLASSES,
    *systems.CLASSES,
    *surface.CLASSES,
    *guides.CLASSES,
    *layers.CLASSES,
    *interpolation.CLASSES,
    *dynamics.CLASSES,
    *styles.CLASSES,
    *shading.CLASSES,
    *tables.CLASSES,
    *output.CLASSES,
    *rendering.CLASSES,
    *collider.CLASSES,
)
