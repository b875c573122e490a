# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of objects that a field offers: functions for `search` of bpy.props."""

from ..host.notices import name_of


def meshes(_owner, context, typed):
    """Return the names of mesh objects."""
    return _matching(typed, (o for o in context.view_layer.objects if o is not None and o.type == "MESH"))


def lines(_owner, context, typed):
    """Return the names of objects that can be drawn lines: curves that are not hair, and meshes without faces."""
    return _matching(typed, (o for o in context.view_layer.objects if o is not None and _has_lines(o)))


def _matching(typed, objects):
    names = (name_of(one) for one in objects)
    return [name for name in names if typed.casefold() in name.casefold()]


def _has_lines(drawn):
    if drawn.type == "CURVES":
        return drawn.data.vellus.kind == "NONE"
    if drawn.type == "MESH":
        return len(drawn.data.edges) > 0 and len(drawn.data.polygons) == 0
    return drawn.type == "CURVE"


SEARCHES = {"line": lines, "flow_lines": lines, "part_lines": lines}  # {name of a setting: function}
