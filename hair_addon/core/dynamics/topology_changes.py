# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles whose topology changes during a simulation: hair collides with their previous state."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import HairError
from .simulation import Obstacle


def stopped(
    obstacles: Sequence[Obstacle], last: Mapping[str, Obstacle], frame: int
) -> tuple[tuple[Obstacle, ...], list[HairError]]:
    """Return (obstacles of a frame, a note for each obstacle whose topology has changed).

    An obstacle with changed topology keeps its last pose. last: {name: obstacle} that this function returned for the
    previous frame. Obstacles that are missing in `last`, or were empty or non-finite, are new.
    """
    taken, notes = [], []
    for obstacle in obstacles:
        before = last.get(obstacle.name)
        if before is None or _is_same(before, obstacle) or not _is_sound(before):
            taken.append(obstacle)
            continue
        taken.append(replace(obstacle, vertices=before.vertices, triangles=before.triangles))
        sentence = "{name} changes its vertices or faces in frame {frame}: hair collides with its previous shape."
        notes.append(HairError(sentence, name=obstacle.name, frame=frame))
    return tuple(taken), notes


def divided(obstacles: Sequence[Obstacle], last: Mapping[str, Obstacle]) -> dict[str, Obstacle]:
    """Return the obstacles of the previous frame whose faces changed, with their present faces, by name.

    Only obstacles with the same number of vertices are included. Blender may triangulate the quads of a mesh
    differently after a change of local coordinates, although the mesh is the same.
    """
    found = {}
    for obstacle in obstacles:
        before = last.get(obstacle.name)
        if before is not None and len(before.vertices) == len(obstacle.vertices) and not _is_same(before, obstacle):
            found[obstacle.name] = replace(before, triangles=obstacle.triangles)
    return found


def _is_same(one, other):
    """Return whether two obstacles have the same topology."""
    return len(one.vertices) == len(other.vertices) and np.array_equal(one.triangles, other.triangles)


def _is_sound(obstacle):
    return len(obstacle.triangles) > 0 and bool(np.isfinite(obstacle.vertices).all())
