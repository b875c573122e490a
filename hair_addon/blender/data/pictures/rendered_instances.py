# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a render shows an instance of a depsgraph, which may be that of a viewport."""


def placed_by(instance):
    """Return the evaluated object that places an instance: its instancer, or itself."""
    return instance.parent if instance.is_instance else instance.object


def is_rendered(instance):
    """Whether a render shows the object of an instance.

    Nodes, faces and particles also scatter objects that are disabled in renders; collection instances leave them out.
    """
    placed = placed_by(instance)
    follows = not instance.is_instance or placed.instance_type == "COLLECTION"
    return not placed.hide_render and not (follows and instance.object.hide_render)
