# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks on Curves whose settings changed: handlers.py is notified by the next depsgraph update."""

import bpy


def mark_geometry(group, _context):
    """Regenerate guides or strands; an `update` of properties."""
    group.id_data.vellus.is_stale = True
    group.id_data.update_tag()


def mark_shading(group, _context):
    """Update what shades them."""
    group.id_data.vellus.is_shading_stale = True
    group.id_data.update_tag()


def mark_shown(group, _context):
    """Let viewports show them otherwise: nothing is computed again."""
    group.id_data.update_tag()


def mark_both(group, context):
    """Do both: for settings that change the shape and the look of hair."""
    mark_geometry(group, context)
    mark_shading(group, context)


def mark_dynamics(group, _context):
    """Simulate from now on with other settings: frames that were simulated before are outdated. Guides stay combed."""
    group.id_data.vellus.is_dynamics_stale = True
    group.id_data.update_tag()


def mark_colliding(group, context):
    """Do it for all guides that collide with an object; group: its settings as a collider."""
    for curves in bpy.data.hair_curves:
        if curves.vellus.kind == "GUIDES" and _collides(curves, group.id_data):
            mark_dynamics(curves.vellus, context)


def _collides(guides, mesh_object):
    settings = guides.vellus.dynamics
    if guides.surface == mesh_object:
        return settings.collides_with_surface
    collection = bpy.data.collections.get(settings.colliders)
    return collection is not None and any(o == mesh_object for o in collection.all_objects)
