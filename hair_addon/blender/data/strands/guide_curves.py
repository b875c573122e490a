# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of a Curves datablock one by one: which are selected, which come and which go. All others keep their bits."""

import numpy as np

from . import attributes

_SELECTION = ".selection"  # Blender's own, of Sculpt Mode and Edit Mode; absent where all is selected
_POINTS, _CURVES = "POINT", "CURVE"


def selection(curves, starts):
    """(S,) float32 in [0, 1]: how much of each curve is selected, the most of its points; None where no one is chosen.

    starts (S+1,): where each curve's points begin.
    """
    for data_type in ("BOOLEAN", "FLOAT"):
        values = attributes.read(curves, _SELECTION, data_type, _CURVES)
        if values is None and len(starts) > 1:
            of_points = attributes.read(curves, _SELECTION, data_type, _POINTS)
            has_points = np.diff(starts) > 0
            if of_points is not None and has_points.any():
                values = np.zeros(len(starts) - 1, np.float32)
                values[has_points] = np.maximum.reduceat(of_points.astype(np.float32), starts[:-1][has_points])
        if values is not None:
            values = np.clip(np.nan_to_num(values.astype(np.float32)), 0.0, 1.0)
            return values if values.any() else None
    return None


def remove(curves, indices):
    """Remove some curves. At least one has to stay: an empty list of them would crash Blender's nodes."""
    if len(indices) >= len(curves.curves):
        raise ValueError("all curves would be removed")
    if len(indices):
        curves.remove_curves(indices=sorted(int(index) for index in indices))


def append(curves, points, sources, starts):
    """Append curves of points (M, P, 3) float32 in local coordinates, with the attributes of others, smooth like them.

    sources: (M,) indices of these; their points' attributes are taken at the same share of the number of points.
    starts (S+1,): where the present curves' points begin.
    """
    count, point_count = points.shape[:2]
    if not count:
        return
    sizes = np.diff(starts)[sources]
    places = np.rint(np.linspace(0.0, 1.0, point_count)[None, :] * (sizes[:, None] - 1)).astype(np.int64)
    of_points = (starts[:-1][sources][:, None] + places).ravel()
    before = {}
    for attribute in curves.attributes:
        is_known = attribute.domain in (_POINTS, _CURVES) and attribute.data_type in attributes.LAYOUTS
        if is_known and attribute.name != "curve_type":
            key = attribute.name, attribute.data_type, attribute.domain
            before[key] = attributes.read(curves, *key)
    types = attributes.curve_types(curves)[sources]
    curves.add_curves([int(point_count)] * int(count))
    # Blender counts the curves of each type, so that the attribute alone cannot be written.
    for is_smooth, name in ((True, "CATMULL_ROM"), (False, "POLY")):
        chosen = np.flatnonzero((types == attributes.CATMULL_ROM) == is_smooth) + len(starts) - 1
        if len(chosen):
            curves.set_types(type=name, indices=[int(index) for index in chosen])
    for (name, data_type, domain), values in before.items():
        added = values[of_points if domain == _POINTS else sources]
        if name == "position":
            added = points.reshape(-1, 3)
        attributes.write(curves, name, data_type, domain, np.concatenate([values, added.astype(values.dtype)]))


def write_tail(curves, name, data_type, values):
    """Write an attribute of the last curves, if there is one of this name and type; values: one each."""
    present = attributes.read(curves, name, data_type, _CURVES)
    if present is not None and len(values):
        present[-len(values) :] = values
        attributes.write(curves, name, data_type, _CURVES, present)
