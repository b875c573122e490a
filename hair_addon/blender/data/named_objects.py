# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects by the names that settings hold: of part lines and flow lines, cutters, directions."""

import bpy

from .usable_surfaces import is_deleted


def find(name):
    """The object of a name; None without a name, and of one that was deleted and is only remembered."""
    found = bpy.data.objects.get(name) if name else None
    return None if found is None or is_deleted(found) else found
