# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks on Curves whose settings changed: handlers.py is notified by the next depsgraph update."""


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
