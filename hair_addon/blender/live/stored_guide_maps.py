# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores guide weights with hair when nodes begin to read them."""

import bpy

from ..data import guide_map_readers
from ..data.strands import attributes, curves
from ..groom import bindings, guide_maps
from ..host.notices import text_of
from . import live_hair


def follow(reports, depsgraph):
    """Store the missing guide weights of hair whose nodes read them; reports: `updates.Update`s."""
    with_nodes = [report for report in reports if report.is_of(bpy.types.NodeTree, bpy.types.Material)]
    for report in with_nodes:
        guide_map_readers.changed(report.datablock)
    objects = {report.datablock for report in reports if report.is_of(bpy.types.Object)} - {None}
    of_changed_objects = {one.data for one in objects if one.type == "CURVES"}
    for hair in bpy.data.hair_curves if with_nodes else of_changed_objects:
        if _lacks_map(hair) and guide_map_readers.are_read(hair):
            _store(hair, depsgraph)


def _lacks_map(hair):
    state = hair.vellus
    if state.kind != "HAIR" or state.guide_curves is None or not len(hair.curves) or text_of(state, "status"):
        return False
    if curves.is_hand_made(hair) or attributes.is_from_library(hair):
        return False
    return not attributes.has(hair, "guide_index_0", "INT", "CURVE")


def _store(hair, depsgraph):
    bound = bindings.of(hair)
    if bound is not None:
        bound.is_map_written = False
        bound.is_due()
        live_hair.write_soon(hair)
        return
    found = guide_maps.of(hair, depsgraph)
    if found is not None:
        curves.write_guide_map(hair, found)
        hair.update_tag()
