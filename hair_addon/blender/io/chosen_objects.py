# SPDX-License-Identifier: GPL-3.0-or-later
"""Restrict Blender's exporters to chosen objects, hidden or not."""

import contextlib

import bpy

_SWITCHES = ("hide_select", "hide_viewport", "hide_render")


@contextlib.contextmanager
def only_chosen(objects):
    """Select only these objects and show them in viewports and renders; restore everything on exit.

    Exporters skip objects that cannot be selected, and some skip objects hidden in renders. Collections can hide
    objects too, so the objects are linked to a temporary collection.
    """
    layer, switched = bpy.context.view_layer, [(one, *(getattr(one, name) for name in _SWITCHES)) for one in objects]
    selected = [other for other in layer.objects if other.select_get()]
    collection = bpy.data.collections.new("Exported")
    bpy.context.scene.collection.children.link(collection)
    for one in objects:
        collection.objects.link(one)
        for name in _SWITCHES:
            setattr(one, name, False)
    layer.update()
    hidden = [one for one in objects if one.hide_get()]
    try:
        for one in hidden:
            one.hide_set(False)
        for other in layer.objects:
            other.select_set(other in objects)
        yield
    finally:
        for other in layer.objects:
            other.select_set(other in selected)
        for one in hidden:
            one.hide_set(True)
        for one, *values in switched:
            for name, value in zip(_SWITCHES, values, strict=True):
                setattr(one, name, value)
        bpy.data.collections.remove(collection)
        layer.update()
