# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks of a mesh: vertex groups and child empties whose names begin with "landmark"."""

import re

import numpy as np

from ..host.notices import name_of
from . import scene

_PREFIX = "landmark"


def read(surface_object, surface, depsgraph):
    """Return {name: (3,) float64 [m]} in the coordinates of a `Surface` at rest.

    A vertex group is at the weighted mean of its vertices, an empty at its origin. Blender's numeric suffixes of names
    are ignored: Landmark nose.001 is Landmark nose.
    """
    found = {}
    for group in surface_object.vertex_groups:
        name = name_of(group)
        if name.casefold().startswith(_PREFIX):
            weights = scene.read_vertex_group(surface_object, depsgraph, name).astype(np.float64)
            if weights.sum() > 0.0:
                found[_plain(name)] = weights @ surface.mesh.vertices / weights.sum()
    origin = np.array(surface_object.matrix_world.translation)
    for child in surface_object.children:
        if child.type == "EMPTY" and name_of(child).casefold().startswith(_PREFIX):
            found[_plain(name_of(child))] = np.array(child.matrix_world.translation) - origin
    return found


def _plain(name):
    return re.sub(r"\.\d{3,}$", "", name).casefold()
