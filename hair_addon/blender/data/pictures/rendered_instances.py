# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of a depsgraph that a render shows, where the depsgraph is that of viewports too."""


def placed_by(instance):
    """The evaluated object that places an instance: its instancer, or itself."""
    return instance.parent if instance.is_instance else instance.object


def is_rendered(instance):
    """Whether a render shows what stands at an instance.

    Nodes, faces and particles scatter objects that are disabled in renders themselves; a collection's instances leave
    them out.
    """
    placed = placed_by(instance)
    follows = not instance.is_instance or placed.instance_type == "COLLECTION"
    return not placed.hide_render and not (follows and instance.object.hide_render)
