# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks on Curves whose settings changed: handlers.py is notified by the next depsgraph update."""

import bpy

_STORED_LOOK = "look.wetness"  # by maps, a number of each strand, as by the style Wet


def mark_geometry(group, _context):
    """Mark guides or strands for regeneration; an `update` of properties."""
    group.id_data.vellus.is_stale = True
    group.id_data.update_tag()


def mark_shading(group, _context):
    """Mark the shading for update."""
    group.id_data.vellus.is_shading_stale = True
    group.id_data.update_tag()


def mark_map(item, context):
    """Mark the shading, the simulation or the strands, whichever the map of a setting changes."""
    if item.setting.startswith("dynamics."):
        mark_dynamics(item, context)
    elif item.setting.startswith("look."):
        mark_shading(item, context)
        if item.setting == _STORED_LOOK:
            mark_geometry(item, context)
    elif item.setting:
        mark_geometry(item, context)


def mark_changed_map(item):
    """Mark the same as `mark_map` after a change of a map's source, within the update that reports the source."""
    state = item.id_data.vellus
    if item.setting.startswith("dynamics."):
        state.is_dynamics_stale = True
    elif item.setting.startswith("look.") and item.setting != _STORED_LOOK:
        state.is_shading_stale = True
    elif item.setting:
        state.is_stale = True


def mark_shown(group, _context):
    """Redraw viewports without recomputing."""
    group.id_data.update_tag()


def mark_dynamics(group, _context):
    """Mark the simulation: simulated frames are outdated, combed guides stay."""
    group.id_data.vellus.is_dynamics_stale = True
    group.id_data.update_tag()


def mark_water(group, context):
    """Mark the shading of hair and the simulation of its guides, whose weight changes; group: of the hair."""
    mark_shading(group, context)
    guides = group.id_data.vellus.guide_curves
    if guides is not None and guides.vellus.simulates and guides.is_editable:
        mark_dynamics(guides.vellus, context)


def mark_wetness(group, context):
    """Like `mark_water`, and write the wetness of strands that a map varies; group: look of the hair."""
    if any(item.setting == _STORED_LOOK for item in group.id_data.vellus.maps):
        mark_geometry(group, context)
    mark_water(group, context)


def mark_wet_style(group, context):
    """Like `mark_water`, and regenerate the hair's styles."""
    mark_geometry(group, context)
    mark_water(group, context)


def mark_water_of_guides(group, context):
    """Mark the simulation of guides, and the shading of the hair that follows them."""
    mark_dynamics(group, context)
    for curves in bpy.data.hair_curves:
        if curves.vellus.guide_curves == group.id_data and curves.is_editable:
            mark_shading(curves.vellus, context)


def mark_colliding(group, context):
    """Mark the simulation of all guides that collide with an object; group: its settings as a collider."""
    for curves in bpy.data.hair_curves:
        if curves.vellus.kind == "GUIDES" and _collides(curves, group.id_data):
            mark_dynamics(curves.vellus, context)


def _collides(guides, mesh_object):
    settings = guides.vellus.dynamics
    if guides.surface == mesh_object:
        return settings.collides_with_surface
    collection = bpy.data.collections.get(settings.colliders)
    return collection is not None and any(o == mesh_object for o in collection.all_objects)
