# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of Curves ↔ arrays."""

import numpy as np

from ....core import geometry, kernels
from ...host import notices

# Data types that can be read as arrays: (name of the value property, components, dtype).
LAYOUTS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "QUATERNION": ("value", 4, np.float32),
    "INT16_2D": ("value", 2, np.int16),
    "INT32_2D": ("value", 2, np.int32),
    "FLOAT4X4": ("value", 16, np.float32),
}

_FLOAT = 4  # bytes

RADIUS = 0.005  # Blender's default for Curves without radii

CATMULL_ROM, POLY = 0, 1  # Blender's curve types; other types have greater numbers


def write(curves, name, data_type, domain, values):
    """Write a value for every point or curve, unless all are unchanged: writing copies data and triggers updates."""
    attribute = curves.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, domain):
        curves.attributes.remove(attribute)
        attribute = None
    value_name, _width, scalar = LAYOUTS[data_type]
    values = np.ascontiguousarray(values, scalar).ravel()
    if attribute is None:
        attribute = curves.attributes.new(name, data_type, domain)
    elif _is_at(attribute, values) or _is_equal(attribute, value_name, values):
        return
    attribute.data.foreach_set(value_name, values)


def write_positions(curves, points, name="position"):
    """Write float32 points (..., 3) of all curves, also of linked and overridden Curves, for which no file stores them.

    name: of an existing attribute. Returns the fingerprint of the points, computed in the same pass. Raises
    `ValueError` if the type or the number of points does not match, as memory would be overrun.
    """
    data, points = curves.attributes[name].data, np.asarray(points, np.float32)
    if not has(curves, name, "FLOAT_VECTOR", "POINT") or points.size != 3 * len(data):
        raise ValueError("the curves have another number of points, or the attribute has no vectors")
    if not len(data):
        return geometry.fingerprint.fingerprint(points)
    # Points are written into Blender's memory: `foreach_set` uses one thread, and silently does nothing where data is
    # not editable in the interface. Single elements can be written there.
    unshare_positions(curves, name)
    target = kernels.foreign_memory.at(data[0].as_pointer(), points.size)
    written = geometry.fingerprint.fingerprint(points, target)
    data[0].vector = target[:3]  # so that Blender recomputes the bounds
    return written


def unshare_positions(curves, name="position"):
    """Make the memory of points unique, which may be shared with evaluated copies and undo steps."""
    data = curves.attributes[name].data
    if len(data):
        _ = data[0]  # the first access to an element copies shared memory


def is_from_library(curves):
    """Whether Curves are linked from another file or a library override."""
    return curves.library is not None or curves.override_library is not None


def _is_at(attribute, values):
    """Whether values are the attribute's own memory, from `view`."""
    data = attribute.data
    return bool(len(data)) and values.dtype == np.float32 and data[0].as_pointer() == values.ctypes.data


def _is_equal(attribute, value_name, values):
    count = len(attribute.data)
    if not count:
        return True
    # Changed values usually differ everywhere: three of them are compared before all are read.
    rows = values.reshape(count, -1)
    for place in {0, count // 2, count - 1}:
        if not np.array_equal(getattr(attribute.data[place], value_name), rows[place].squeeze()):
            return False
    present = np.empty_like(values)
    attribute.data.foreach_get(value_name, present)
    return np.array_equal(present, values)


def has(curves, name, data_type, domain):
    """Whether there is an attribute of this name, type and domain."""
    attribute = curves.attributes.get(name)
    return attribute is not None and (attribute.data_type, attribute.domain) == (data_type, domain)


def read(curves, name, data_type, domain):
    """Read (N,) or (N, width) values; None if there is no attribute of this name, type and domain.

    Users or nodes may have stored any data under our names.
    """
    if not has(curves, name, data_type, domain):
        return None
    attribute = curves.attributes[name]
    value_name, width, scalar = LAYOUTS[data_type]
    values = np.empty((len(attribute.data), width), scalar)
    attribute.data.foreach_get(value_name, values.ravel())
    return values[:, 0] if width == 1 else values


def read_into(curves, name, data_type, domain, out):
    """Read float values into a contiguous array, zeros without an attribute of this type and domain."""
    if not has(curves, name, data_type, domain):
        out[...] = 0.0
        return
    attribute = curves.attributes[name]
    if len(attribute.data):
        attribute.data.foreach_get(LAYOUTS[data_type][0], out.ravel())


def view(curves, name, data_type, domain):
    """Return float values like `read`, as a view of Blender's memory, which no copy shares any longer; None as `read`.

    The view is valid until the next evaluation, undo step or change of the number of values. Writing to the view
    changes the attribute.
    """
    if not has(curves, name, data_type, domain):
        return None
    data, (_value_name, width, _scalar) = curves.attributes[name].data, LAYOUTS[data_type]
    if not len(data):
        return read(curves, name, data_type, domain)
    first, last = data[0].as_pointer(), data[len(data) - 1].as_pointer()
    if last - first != _FLOAT * width * (len(data) - 1):
        return read(curves, name, data_type, domain)  # not an array of numbers
    values = kernels.foreign_memory.at(first, width * len(data))
    return values if width == 1 else values.reshape(-1, width)


def repeats(values, row):
    """Whether values (N,) repeat a row; compared in blocks that fit the CPU caches."""
    some = np.tile(row, 4096)
    parts = (values[first : first + len(some)] for first in range(0, len(values), len(some)))
    return all(np.array_equal(part, some[: len(part)]) for part in parts)


def are_radii(values, radii):
    """Whether values (N,) are radii (P,) that all strands have, or (S, P) of each."""
    return repeats(values, radii) if radii.ndim == 1 else np.array_equal(values, radii.ravel())


def valid_radii(radii):
    """Radii with negative and excessive values replaced by Blender's default; the same array if there are none."""
    if radii.size and radii.min() >= 0.0 and radii.max() <= notices.LARGEST:  # takes a fifth of the time; false for NaN
        return radii
    return np.where((radii >= 0.0) & (radii <= notices.LARGEST), radii, np.float32(RADIUS))


def curve_types(curves):
    """Return (S,) int8: Blender's type of each curve."""
    types = read(curves, "curve_type", "INT8", "CURVE")
    return np.full(len(curves.curves), CATMULL_ROM, np.int8) if types is None else types


def are_smooth(curves):
    """Return (S,) bool: which curves are Catmull-Rom splines, as brushes create them."""
    return curve_types(curves) == CATMULL_ROM


def reorder_points(curves, order):
    """Reorder all point attributes: point i gets the value of point order[i]; order: (N,)."""
    for attribute in curves.attributes:
        layout = LAYOUTS.get(attribute.data_type)
        if attribute.domain != "POINT" or layout is None:
            continue
        name, width, kind = layout
        values = np.empty((len(order), width), kind)
        attribute.data.foreach_get(name, values.ravel())
        attribute.data.foreach_set(name, np.ascontiguousarray(values[order]).ravel())
