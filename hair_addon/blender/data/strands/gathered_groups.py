# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of gathered guides: an integer attribute of guides, equal for guides of one tie or lock, 0 for all others."""

import numpy as np

from . import attributes

NAME = "gathered"


def read(datablock):
    """Return (G,) int32: the group of each guide; None if no guide is gathered."""
    found = attributes.read(datablock, NAME, "INT", "CURVE")
    return found if found is not None and found.any() else None


def write(datablock, groups):
    """Store the groups (G,) of guides; the attribute is removed if they are None or all 0."""
    is_gathered = groups is not None and groups.any()
    present = datablock.attributes.get(NAME)
    if present is not None and not (is_gathered and attributes.has(datablock, NAME, "INT", "CURVE")):
        datablock.attributes.remove(present)
    if is_gathered:
        attributes.write(datablock, NAME, "INT", "CURVE", groups.astype(np.int32))


def add(datablock, groups):
    """Store new groups (G,) of guides, 0 for guides that keep their own; groups that are equal before stay apart."""
    present = read(datablock)
    if present is None:
        present = np.zeros(len(groups), np.int32)
    others = np.where(groups > 0, 0, present)
    write(datablock, np.where(groups > 0, groups + others.max(initial=0), others))
