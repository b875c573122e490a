# SPDX-License-Identifier: GPL-3.0-or-later
"""All operators, one file per subject. An operator reads, computes and writes."""

from . import (
    conversion,
    dynamics,
    flow_painting,
    freezing,
    guide_layers,
    guide_tools,
    library,
    looks,
    maps,
    output,
    pictures,
    selection_sets,
    styles,
    surface,
    systems,
)

SUBJECTS = (
    systems,
    surface,
    conversion,
    guide_tools,
    flow_painting,
    guide_layers,
    freezing,
    selection_sets,
    styles,
    dynamics,
    looks,
    maps,
    library,
    pictures,
    output,
)
CLASSES = tuple(cls for subject in SUBJECTS for cls in subject.CLASSES)
