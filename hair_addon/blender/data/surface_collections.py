# SPDX-License-Identifier: GPL-3.0-or-later
"""Where new objects go: beside the surface that they belong to."""

import bpy


def collection_of(surface_object):
    """The collection of a surface that the view layer shows; else one that it has, else any; the scene's without any.

    A mesh may be in a collection that only lists it, as colliders are, which is hidden, excluded or in no scene. Where
    Blender adds nothing, as the collection is linked or a library override, it is the scene's too.
    """
    owners = surface_object.users_collection
    layers = list(_layers(bpy.context.view_layer.layer_collection))
    shown = {layer.collection for layer in layers if layer.is_visible}
    present = {layer.collection for layer in layers}
    ranked = ([owner for owner in owners if owner in known] for known in (shown, present, owners))
    best = next(filter(None, ranked), [])
    return next((owner for owner in best if _takes_objects(owner)), bpy.context.scene.collection)


def _takes_objects(collection):
    return collection.library is None and collection.override_library is None


def _layers(layer_collection):
    """A layer collection and all below it that are not excluded."""
    yield layer_collection
    for child in layer_collection.children:
        if not child.exclude:
            yield from _layers(child)
