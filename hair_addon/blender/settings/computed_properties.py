# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties without storage: values are read from and written to other data."""

import bpy

from .translations import CONTEXT

_NOT_KEYED = set()  # options of properties that cannot be keyed


def computed_text(name, description, get, set):
    """Return a string property; get(group), set(group, text): as in bpy.props."""
    return bpy.props.StringProperty(**_computed(name, description, get, set), options=_NOT_KEYED)


def computed_flag(name, description, get, set):
    """Return a boolean property, editable also if the group's datablock is linked."""
    return bpy.props.BoolProperty(**_computed(name, description, get, set), options={"LIBRARY_EDITABLE"})


def computed_index(name, description, get, set):
    """Return a property of a list index, -1 for none."""
    return bpy.props.IntProperty(**_computed(name, description, get, set), options=_NOT_KEYED)


def _computed(name, description, get, set):
    return {"name": name, "description": description, "get": get, "set": set, "translation_context": CONTEXT}
