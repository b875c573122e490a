# SPDX-License-Identifier: GPL-3.0-or-later
"""The collection of new objects: that of their surface."""

import bpy


def collection_of(surface_object):
    """Return a collection of a surface: preferably visible in the view layer, else in the view layer, else any.

    A mesh may also be in a collection that only lists it, such as one of colliders, which may be hidden, excluded or in
    no scene. The scene's collection if all of these are linked or library overrides, to which Blender adds nothing.
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
    """Yield a layer collection and all of its children that are not excluded, recursively."""
    yield layer_collection
    for child in layer_collection.children:
        if not child.exclude:
            yield from _layers(child)
