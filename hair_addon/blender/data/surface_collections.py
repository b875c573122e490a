# SPDX-License-Identifier: GPL-3.0-or-later
"""Where new objects go: beside the surface that they belong to."""

import bpy


def collection_of(surface_object):
    """The collection of a surface that the view layer shows; else one that it has, else any; the scene's without any.

    A mesh may be in a collection that only lists it, as colliders are, which is hidden, excluded or in no scene.
    """
    owners = [owner for owner in surface_object.users_collection if owner.library is None]
    layers = list(_layers(bpy.context.view_layer.layer_collection))
    shown = {layer.collection for layer in layers if layer.is_visible}
    present = {layer.collection for layer in layers}
    ranked = [owner for known in (shown, present, owners) for owner in owners if owner in known]
    return ranked[0] if ranked else bpy.context.scene.collection


def _layers(layer_collection):
    """A layer collection and all below it that are not excluded."""
    yield layer_collection
    for child in layer_collection.children:
        if not child.exclude:
            yield from _layers(child)
