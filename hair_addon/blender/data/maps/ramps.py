# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps: curves of the thickness from root to tip, and curves and color ramps of a map's values, as samples."""

import numpy as np

from ...settings import ramp_nodes
from ...settings.ramp_nodes import node_of

SAMPLES = 256


def new_ramp(name, end):
    """Return a new node group whose curve decreases linearly from 1 at the root to `end` at the tip."""
    return ramp_nodes.new_tree(name, f"0:1 1:{end}")


def samples(tree) -> np.ndarray | None:
    """Return (`SAMPLES`,) float32 values of the curve of a node group, in [0, 1]; None without a curve."""
    node = node_of(tree)
    if node is None or ramp_nodes.is_color(node):
        return None
    mapping = node.mapping
    mapping.initialize()
    curve = mapping.curves[0]
    return _limited([mapping.evaluate(curve, float(place)) for place in np.linspace(0.0, 1.0, SAMPLES)])


def map_samples(item, is_color: bool) -> np.ndarray | None:
    """Return (`SAMPLES`, 1) of the curve of a map, or (`SAMPLES`, 4) colors multiplied by alpha; None without such a
    ramp.
    """
    node = node_of(item.ramp_tree)
    if node is None or ramp_nodes.is_color(node) != is_color:
        return None
    if not is_color:
        return samples(item.ramp_tree)[:, None]
    ramp = node.color_ramp
    found = _limited([ramp.evaluate(float(place)) for place in np.linspace(0.0, 1.0, SAMPLES)])
    found[:, :3] *= found[:, 3:]
    return found


def _limited(values):
    values = np.array(values, np.float32)
    return np.clip(np.where(np.isfinite(values), values, np.float32(0.0)), np.float32(0.0), np.float32(1.0))
