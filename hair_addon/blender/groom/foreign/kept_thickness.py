# SPDX-License-Identifier: GPL-3.0-or-later
"""Thickness of kept hair by the map and the curve of its thickness."""

import numpy as np
from bpy.types import Curves

from ....core import geometry
from ....core.errors import HairError
from ...data.maps import ramps, sources
from ...data.strands import attributes, curves, kept_widths
from ...settings import map_items, ramp_nodes
from .. import strand_thickness


def follow(hair: Curves) -> bool:
    """Give kept hair the thickness of its map and its curve; returns whether it has or had any.

    A map multiplies the radii that each strand came with; a curve gives the radii from root to tip as parts of the
    strand's radius at the root. A sentence about a missing source becomes the status of the hair.
    """
    state = hair.vellus
    item, course = map_items.item_of(state, strand_thickness.SETTING), ramps.samples(state.thickness_ramp)
    has_map = item is not None and map_items.is_set(item)
    if attributes.is_from_library(hair) or not len(hair.curves):
        return False
    if not has_map and course is None and not kept_widths.are_kept(hair):
        return False
    state.status, factors = "", None
    if has_map:
        try:
            factors = strand_thickness.factors(sources.stored_strands(hair), item)
        except HairError as error:
            state.status = str(error)
    state.thickness_key, state.is_stale = ramp_nodes.text_of(state.thickness_ramp), False
    if factors is None and course is None:
        kept_widths.restore(hair)
    else:
        kept_widths.change(hair, _radii(hair, factors, course))
    hair.update_tag()
    return True


def _radii(hair, factors, course):
    """Return radii (N,) float32."""
    radii, starts = kept_widths.own(hair), curves.curve_offsets(hair)
    counts = np.diff(starts)
    if course is not None:
        along = geometry.strands.places_along(curves.read_points(hair), starts)
        shares = np.interp(along, np.linspace(0.0, 1.0, len(course)), course)
        radii = np.repeat(radii[starts[:-1]], counts) * shares.astype(np.float32)
    return radii if factors is None else radii * np.repeat(factors, counts)
