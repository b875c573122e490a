# SPDX-License-Identifier: GPL-3.0-or-later
"""Freezing of guides: points that strokes and guide tools leave where they are."""

import numpy as np
from bpy.types import Curves

from ....core.errors import HairError
from ...data.strands import curves, frozen_points
from ...host.notices import name_of


def freeze_selected(guides: Curves) -> int:
    """Freeze the selected points of guides too; returns the number of frozen points. Raises `HairError`."""
    _require_editable(guides)
    selected = frozen_points.selected(guides)
    if selected is None:
        raise HairError("Select guides, or points of guides, in Sculpt Mode or Edit Mode first.")
    return _write(guides, selected | _frozen(guides))


def unfreeze_all(guides: Curves) -> int:
    """Let all points of guides be combed; returns how many were frozen. Raises `HairError`."""
    _require_editable(guides)
    count = int(_frozen(guides).sum())
    _write(guides, np.zeros(len(guides.points), bool))
    return count


def invert(guides: Curves) -> int:
    """Freeze all points that are not frozen, and unfreeze the others.

    Returns the number of frozen points. Raises `HairError`.
    """
    _require_editable(guides)
    return _write(guides, ~_frozen(guides))


def _frozen(guides):
    found = frozen_points.read(guides)
    return np.zeros(len(guides.points), bool) if found is None else found


def _write(guides, are_frozen):
    frozen_points.write(guides, are_frozen)
    return int(are_frozen.sum())


def _require_editable(guides):
    curves.require_editable(guides)
    if not len(guides.points):
        raise HairError('"{name}" has no guides: generate guides first.', name=name_of(guides))
