# SPDX-License-Identifier: GPL-3.0-or-later
"""Single guides of a Curves datablock: selection, removal and addition. All other guides keep their exact values."""

import numpy as np

from . import attributes

SELECTION = ".selection"  # Blender's attribute of Sculpt Mode and Edit Mode; absent if all is selected
_POINTS, _CURVES = "POINT", "CURVE"


def selection(curves, starts):
    """Return (S,) float32 in [0, 1]: the selection of each curve, or its most selected point; None if nothing is
    selected.

    starts (S+1,): index of each curve's first point.
    """
    for data_type in ("BOOLEAN", "FLOAT"):
        values = attributes.read(curves, SELECTION, data_type, _CURVES)
        if values is None and len(starts) > 1:
            of_points = attributes.read(curves, SELECTION, data_type, _POINTS)
            has_points = np.diff(starts) > 0
            if of_points is not None and has_points.any():
                values = np.zeros(len(starts) - 1, np.float32)
                values[has_points] = np.maximum.reduceat(of_points.astype(np.float32), starts[:-1][has_points])
        if values is not None:
            values = np.clip(np.nan_to_num(values.astype(np.float32)), 0.0, 1.0)
            return values if values.any() else None
    return None


def selected_points(curves, starts):
    """Return (N,) bool: the points that are at least half selected; None if all or none are. starts (S+1,): as
    above.
    """
    found = stored_selection(curves, starts)
    return found if found is not None and found.any() and not found.all() else None


def stored_selection(curves, starts):
    """Return (N,) bool: the points that are at least half selected; None if all are, because Blender stores no
    selection. starts (S+1,): as above.
    """
    for data_type in ("BOOLEAN", "FLOAT"):
        for domain in (_POINTS, _CURVES):
            values = attributes.read(curves, SELECTION, data_type, domain)
            if values is not None:
                found = values.astype(np.float32) >= 0.5
                return np.repeat(found, np.diff(starts)) if domain == _CURVES else found
    return None


def remove(curves, indices):
    """Remove some curves. At least one must remain: an empty list of curves would crash Blender's nodes."""
    if len(indices) >= len(curves.curves):
        raise ValueError("all curves would be removed")
    if len(indices):
        curves.remove_curves(indices=sorted(int(index) for index in indices))


def append(curves, points, sources, starts):
    """Append curves of (M, P, 3) float32 points in local coordinates, with the attributes and types of existing curves.

    sources: (M,) indices of these curves; attributes of their points are sampled at the same fraction of the points.
    starts (S+1,): index of each existing curve's first point.
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
    """Write an attribute of the last curves, if one of this name and type exists; values: one per curve."""
    present = attributes.read(curves, name, data_type, _CURVES)
    if present is not None and len(values):
        present[-len(values) :] = values
        attributes.write(curves, name, data_type, _CURVES, present)
