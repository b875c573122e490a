# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties without storage: values are read from and written to other data."""

import bpy

from .translations import CONTEXT

_NOT_KEYED = set()  # of properties that take no keys


def computed_text(name, description, get, set):
    """A line of text of a group that is stored elsewhere; get(group), set(group, text): as in bpy.props."""
    return bpy.props.StringProperty(**_computed(name, description, get, set), options=_NOT_KEYED)


def computed_flag(name, description, get, set):
    """The same for a boolean, also if the group's datablock is linked."""
    return bpy.props.BoolProperty(**_computed(name, description, get, set), options={"LIBRARY_EDITABLE"})


def computed_index(name, description, get, set):
    """The same for a list index, -1 for none."""
    return bpy.props.IntProperty(**_computed(name, description, get, set), options=_NOT_KEYED)


def _computed(name, description, get, set):
    return {"name": name, "description": description, "get": get, "set": set, "translation_context": CONTEXT}
