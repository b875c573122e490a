# SPDX-License-Identifier: GPL-3.0-or-later
"""Frozen points of guides, which combing and guide tools leave where they are: a boolean attribute of points."""

import numpy as np

from . import attributes, curves, guide_curves

FROZEN = "frozen"


def read(datablock):
    """Return (N,) bool: which points of guides are frozen; None if none is."""
    found = attributes.read(datablock, FROZEN, "BOOLEAN", "POINT")
    return found if found is not None and found.any() else None


def write(datablock, are_frozen):
    """Store which points (N,) are frozen; the attribute is removed if none is."""
    present = datablock.attributes.get(FROZEN)
    if present is not None and not (are_frozen.any() and attributes.has(datablock, FROZEN, "BOOLEAN", "POINT")):
        datablock.attributes.remove(present)
    if are_frozen.any():
        attributes.write(datablock, FROZEN, "BOOLEAN", "POINT", are_frozen)
    datablock.update_tag()


def selected(datablock):
    """Return (N,) bool: the points that are selected in Sculpt Mode or Edit Mode; None if all or none are."""
    return guide_curves.selected_points(datablock, curves.curve_offsets(datablock))


def restored(datablock, before, after):
    """Return points (N, 3) after an edit, with frozen points as before; `after` itself if none has moved."""
    are_frozen = read(datablock)
    if are_frozen is None or before is None or before.shape != after.shape or len(are_frozen) != len(after):
        return after
    is_moved = are_frozen & (before != after).any(axis=1)
    return np.where(is_moved[:, None], before, after) if is_moved.any() else after
