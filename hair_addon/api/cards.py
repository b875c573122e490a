# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: hair for games."""

import os
from typing import Any

from ..core.cards.card_settings import CardSettings, TubeSettings
from ..core.long_work import Progress, no_progress, run_now
from .arguments import changed, checked_progress, path_of
from .blender_access import blender

Curves = Any
MeshObject = Any

__all__ = ["CardSettings", "TubeSettings", "make_hair_cards", "make_hair_tubes"]


def make_hair_cards(
    hair: Curves,
    settings: CardSettings | None = None,
    *,
    folder: str | os.PathLike | None = None,
    progress: Progress = no_progress,
    **changes: Any,
) -> list[MeshObject]:
    """Create cards of hair, with textures of its strands; returns a mesh object for each level, finest first.

    hair: hair Curves; settings: `CardSettings`; folder: for the textures' .png files, None packs them into the .blend
    file; changes: fields of `CardSettings` by name. With error_measure "MEASURED" or "MINIMIZED", the objects have the
    properties "coverage_error" and "flip_error", from 0 to 1.

    >>> settings = {"card_count": 60, "segment_count": 4, "level_count": 2, "texture_size": 256}
    >>> cards, fewer = api.make_hair_cards(bpy.data.objects["Hair"], **settings)
    >>> len(cards.data.polygons), len(fewer.data.polygons)
    (240, 60)
    """
    wanted, place = changed(CardSettings, settings, changes), None if folder is None else path_of(folder)
    target = blender.data.arguments.curves_of(hair, "HAIR")
    levels = run_now(blender.io.hair_cards.making_cards(target, wanted, place), checked_progress(progress))
    _print(levels[0].notes)
    return [level.mesh_object for level in levels]


def make_hair_tubes(
    hair: Curves, settings: TubeSettings | None = None, *, progress: Progress = no_progress, **changes: Any
) -> MeshObject:
    """Create a mesh object of hair strands as closed tubes with UV coordinates.

    hair: hair Curves; settings: `TubeSettings`; changes: its fields by name.

    >>> tubes = api.make_hair_tubes(bpy.data.objects["Hair"], tube_count=100, side_count=3, point_count=5)
    >>> len(tubes.data.vertices)
    1500
    """
    wanted = changed(TubeSettings, settings, changes)
    target = blender.data.arguments.curves_of(hair, "HAIR")
    result = run_now(blender.io.hair_meshes.making_tubes(target, wanted), checked_progress(progress))
    _print(result.notes)
    return result.mesh_object


def _print(notes):
    for note in notes:
        blender.host.notices.say(str(note))
