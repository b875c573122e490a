# SPDX-License-Identifier: GPL-3.0-or-later
"""Named selections of guides: boolean attributes of points, and Blender's own selection."""

import numpy as np

from ...host.notices import name_of
from . import attributes, curves, guide_curves

_PREFIX = "selection_"


def names(datablock):
    """Return the sorted names of the selection sets of guides."""
    found = [name_of(one) for one in datablock.attributes if (one.data_type, one.domain) == ("BOOLEAN", "POINT")]
    return sorted(name.removeprefix(_PREFIX) for name in found if name.startswith(_PREFIX))


def read(datablock, name):
    """Return (N,) bool: the points of a set; None if there is no set of this name."""
    return attributes.read(datablock, _PREFIX + name, "BOOLEAN", "POINT")


def write(datablock, name, are_chosen):
    """Store the chosen points (N,) bool as a set; a set of this name is replaced."""
    attributes.write(datablock, _PREFIX + name, "BOOLEAN", "POINT", are_chosen)


def remove(datablock, name):
    """Remove a set."""
    datablock.attributes.remove(datablock.attributes[_PREFIX + name])


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
        domain, values = "CURVE", np.logical_or.reduceat(are_chosen, curves.curve_offsets(datablock)[:-1])
    attributes.write(datablock, guide_curves.SELECTION, "BOOLEAN", domain, values)
    datablock.update_tag()
