# SPDX-License-Identifier: GPL-3.0-or-later
"""Original shapes of kept hair and of the guides derived from it.

Stored as points in an attribute, so that files, undo and brushes that remove curves keep them with their curves.
"""

import numpy as np

from ....core import geometry
from . import attributes, curves, layer_attributes

_SHAPE = "kept_position"


def read(datablock):
    """Return (N, 3) float32 points of the kept shape in local coordinates, or None."""
    return attributes.read(datablock, _SHAPE, "FLOAT_VECTOR", "POINT")


def keep(datablock, points):
    """Store (N, 3) points as the kept shape; of linked and overridden Curves until their file is read again."""
    if not attributes.is_from_library(datablock):
        attributes.write(datablock, _SHAPE, "FLOAT_VECTOR", "POINT", points)
        return
    if not attributes.has(datablock, _SHAPE, "FLOAT_VECTOR", "POINT"):
        other = datablock.attributes.get(_SHAPE)
        if other is not None:
            datablock.attributes.remove(other)
        datablock.attributes.new(_SHAPE, "FLOAT_VECTOR", "POINT")
    if not np.array_equal(read(datablock), points):
        attributes.write_positions(datablock, points, _SHAPE)


def forget(datablock):
    """Remove the kept shape."""
    if attributes.has(datablock, _SHAPE, "FLOAT_VECTOR", "POINT"):
        datablock.attributes.remove(datablock.attributes[_SHAPE])
    datablock.vellus.kept_written = ""


def write_strands(hair, points):
    """Write (N, 3) points of kept strands that guides have moved."""
    hair.vellus.kept_written = attributes.write_positions(hair, points)
    hair.update_tag()


def is_edited(hair, present):
    """Whether an artist has moved strands since `write_strands`; present: (N, 3) current points."""
    written = hair.vellus.kept_written
    return written != "" and written != geometry.fingerprint.fingerprint(present)


def move(datablock, function, of_shape=None):
    """Move points of Curves and their kept shape; function: (N, 3) float32 → (N, 3) float32.

    of_shape: the function for the shape; None: the same as for points.
    """
    present, shape = curves.read_points(datablock), read(datablock)
    was_written = datablock.vellus.kept_written != "" and not is_edited(datablock, present)
    moved = np.ascontiguousarray(function(present), np.float32)
    had_layers = datablock.vellus.layered == geometry.fingerprint.fingerprint(present)
    layer_attributes.move(datablock, function)
    curves.write_moved(datablock, moved)
    if had_layers:
        datablock.vellus.layered = geometry.fingerprint.fingerprint(moved)
    if shape is not None:
        keep(datablock, (of_shape or function)(shape))
    if was_written:
        datablock.vellus.kept_written = geometry.fingerprint.fingerprint(moved)
