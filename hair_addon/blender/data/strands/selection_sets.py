# SPDX-License-Identifier: GPL-3.0-or-later
"""Named selections of guides: boolean attributes of points, and Blender's own selection."""

import numpy as np

from ...settings.selection_names import PREFIX
from . import attributes, curves, guide_curves


def has(datablock, name):
    """Whether there is a set of this name."""
    return attributes.has(datablock, PREFIX + name, "BOOLEAN", "POINT")


def read(datablock, name):
    """Return (N,) bool: the points of a set; None if there is no set of this name."""
    return attributes.read(datablock, PREFIX + name, "BOOLEAN", "POINT")


def read_guides(datablock, name):
    """Return (G,) bool: the guides with points in a set; None if there is no set of this name."""
    are_chosen = read(datablock, name)
    return None if are_chosen is None else _of_curves(datablock, are_chosen)


def write(datablock, name, are_chosen):
    """Store the chosen points (N,) bool as a set; a set of this name is replaced."""
    attributes.write(datablock, PREFIX + name, "BOOLEAN", "POINT", are_chosen)


def remove(datablock, name):
    """Remove a set."""
    datablock.attributes.remove(datablock.attributes[PREFIX + name])


def selected(datablock):
    """Return (N,) bool: the points that are selected in Sculpt Mode or Edit Mode; None if all or none are."""
    return guide_curves.selected_points(datablock, curves.curve_offsets(datablock))


def present(datablock):
    """Return (N,) bool: the points that are selected in Sculpt Mode or Edit Mode."""
    stored = guide_curves.stored_selection(datablock, curves.curve_offsets(datablock))
    return np.ones(len(datablock.points), bool) if stored is None else stored


def select(datablock, are_chosen):
    """Select points (N,) bool of guides; whole guides if Blender selects whole curves."""
    domain, values = "POINT", are_chosen
    if datablock.selection_domain == "CURVE":
        domain, values = "CURVE", _of_curves(datablock, are_chosen)
    attributes.write(datablock, guide_curves.SELECTION, "BOOLEAN", domain, values)
    datablock.update_tag()


def _of_curves(datablock, are_chosen):
    """Return (N,) bool: the curves with any of the chosen points (M,) bool."""
    return np.logical_or.reduceat(are_chosen, curves.curve_offsets(datablock)[:-1])
