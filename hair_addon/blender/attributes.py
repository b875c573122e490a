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
    else:
        present = np.empty_like(values)
        attribute.data.foreach_get(value_name, present)
        if np.array_equal(present, values):
            return
    attribute.data.foreach_set(value_name, values)


def read(curves, name, width):
    """(N, width) float32, or None where the attribute is missing."""
    attribute = curves.attributes.get(name)
    if attribute is None:
        return None
    values = np.empty((len(attribute.data), width), np.float32)
    attribute.data.foreach_get("vector" if width > 1 else "value", values.ravel())
    return values
