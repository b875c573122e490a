# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathered guides: attributes of their groups, equal for guides of one tie or lock, and of the part up to the tie."""

from dataclasses import dataclass

import numpy as np

from . import attributes

NAME = "gathered"
HELD = "gathered_held"
_TYPES = ((NAME, "INT"), (HELD, "FLOAT"))


@dataclass(frozen=True)
class Gathered:
    """groups (G,) int32: 0 for guides that are not gathered; held (G,) float32: part of the length up to the tie."""

    groups: np.ndarray
    held: np.ndarray

    def __getitem__(self, chosen):
        return Gathered(self.groups[chosen], self.held[chosen])


def read(datablock):
    """Return the `Gathered` of guides; None if no guide is gathered."""
    groups = attributes.read(datablock, NAME, "INT", "CURVE")
    if groups is None or not groups.any():
        return None
    held = attributes.read(datablock, HELD, "FLOAT", "CURVE")
    held = np.zeros(len(groups), np.float32) if held is None else np.clip(np.nan_to_num(held), 0.0, 1.0)
    return Gathered(groups, np.where(groups != 0, held, 0.0).astype(np.float32))


def write(datablock, gathered):
    """Store the `Gathered` of guides; the attributes are removed if it is None or no guide is gathered."""
    is_any = gathered is not None and gathered.groups.any()
    for name, data_type in _TYPES:
        present = datablock.attributes.get(name)
        if present is not None and not (is_any and attributes.has(datablock, name, data_type, "CURVE")):
            datablock.attributes.remove(present)
    if is_any:
        attributes.write(datablock, NAME, "INT", "CURVE", gathered.groups.astype(np.int32))
        attributes.write(datablock, HELD, "FLOAT", "CURVE", gathered.held.astype(np.float32))


def add(datablock, gathered):
    """Store new groups of guides, which are apart from equal numbers before; guides with 0 keep their own."""
    present = read(datablock)
    if present is None:
        present = Gathered(np.zeros(len(gathered.groups), np.int32), np.zeros(len(gathered.groups), np.float32))
    is_new = gathered.groups > 0
    others = np.where(is_new, 0, present.groups)
    groups = np.where(is_new, gathered.groups + others.max(initial=0), others)
    write(datablock, Gathered(groups, np.where(is_new, gathered.held, present.held)))
