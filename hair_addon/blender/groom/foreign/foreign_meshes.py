# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh objects of cards, tubes and locks, and the surface that their hair grows on."""

from collections.abc import Iterable

from bpy.types import Object, ViewLayer

from ....core.errors import HairError


def is_hair_mesh_chosen(active: Object | None, selected: Iterable[Object]) -> bool:
    """Whether the active object is a mesh beside one other selected mesh, on which its hair could grow."""
    if active is None or active.type != "MESH":
        return False
    return sum(one.type == "MESH" and one != active for one in selected) == 1


def find_surface(mesh_object: Object, view_layer: ViewLayer, selected: Iterable[Object], name: str = "") -> Object:
    """Return the mesh object that the hair of a mesh grows on. Raises `HairError`.

    The surface is the mesh object with a given name, otherwise the only other mesh among the selected objects,
    otherwise a parent that is a mesh.
    """
    if name:
        found = view_layer.objects.get(name)
        if found is None or found.type != "MESH":
            raise HairError('There is no mesh object "{name}".', name=name)
        return found
    others = [one for one in selected if one.type == "MESH" and one != mesh_object]
    if len(others) == 1:
        return others[0]
    parent = mesh_object.parent
    while parent is not None and parent.type != "MESH":
        parent = parent.parent
    if parent is None or others:
        raise HairError("Select the mesh that the hair grows on, and then the mesh of cards, tubes or locks.")
    return parent
