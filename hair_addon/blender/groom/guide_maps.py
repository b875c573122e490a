# SPDX-License-Identifier: GPL-3.0-or-later
"""The present guides of strands and their weights, for exporters, whether they are stored or not."""

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core.errors import HairError
from ..data.strands import curves, exported_curves
from . import bindings, pipeline


def of(hair: Curves, depsgraph: Depsgraph) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (S, k) int32 guides of strands, -1 for none, and (S, k) float32 weights, whether stored or not.

    None if hair follows no guides, or if its strands do not match its settings and guides.
    """
    guides, bound = hair.vellus.guide_curves, bindings.of(hair)
    if guides is None:
        return None
    if bound is None:
        stored = exported_curves.read_guide_map(hair, len(guides.curves))
        if stored is not None or curves.is_hand_made(hair):
            return stored
        try:
            bound = pipeline.bind_hair(*pipeline.inputs_of(hair), depsgraph, hair)
        except HairError:
            return None
        if bound.root_key != hair.vellus.root_key:
            return None
    bound.update_points()
    indices, weights = bound.guide_map
    return (indices, weights) if len(indices) == len(hair.curves) else None
