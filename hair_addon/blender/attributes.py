# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of Curves ↔ arrays."""

import numpy as np

# How an attribute's values are called by its data type.
_VALUE_NAMES = {"FLOAT": "value", "INT": "value", "FLOAT2": "vector", "FLOAT_VECTOR": "vector"}


def write(curves, name, data_type, domain, values):
    """Give every point or curve a value, unless each has it already: what is written is copied, and read by others."""
    attribute = curves.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, domain):
        curves.attributes.remove(attribute)
        attribute = None
    scalar, value_name = np.int32 if data_type == "INT" else np.float32, _VALUE_NAMES[data_type]
    values = np.ascontiguousarray(values, scalar).ravel()
    if attribute is None:
        attribute = curves.attributes.new(name, data_type, domain)
    elif _holds(attribute, value_name, values):
        return
    attribute.data.foreach_set(value_name, values)


def _holds(attribute, value_name, values):
    count = len(attribute.data)
    if not count:
        return True
    # As a rule other values differ everywhere: three of them say so before all are read.
    rows = values.reshape(count, -1)
    for place in {0, count // 2, count - 1}:
        if not np.array_equal(getattr(attribute.data[place], value_name), rows[place].squeeze()):
            return False
    present = np.empty_like(values)
    attribute.data.foreach_get(value_name, present)
    return np.array_equal(present, values)


def read(curves, name, width):
    """(N, width) float32, or None where the attribute is missing."""
    attribute = curves.attributes.get(name)
    if attribute is None:
        return None
    values = np.empty((len(attribute.data), width), np.float32)
    attribute.data.foreach_get("vector" if width > 1 else "value", values.ravel())
    return values
