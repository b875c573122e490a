# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's reports of updates, copied before anything else is done.

Handlers of other add-ons may have deleted reported datablocks before ours runs; the reports then point to freed memory.
The evaluated copies still exist, as the depsgraph owns them: they identify the remaining datablocks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import bpy


@dataclass(frozen=True)
class Update:
    """A report of one datablock.

    datablock: None if deleted since, and, if other handlers have run before, for data embedded in another datablock.
    """

    kind: type
    datablock: bpy.types.ID | None
    is_geometry: bool
    is_transform: bool
    is_shading: bool

    def is_of(self, *kinds: type) -> bool:
        """Whether the datablock is of any of some Blender types."""
        return issubclass(self.kind, kinds)


def read(depsgraph: Any, handlers: Sequence[Any], own: Any) -> list[Update]:
    """All reports of an update; own: the running handler; handlers: Blender's list that contains it."""
    present = None if handlers[0] is own else _Present(depsgraph)
    found = []
    for update in depsgraph.updates:
        evaluated = update.id
        datablock = evaluated.original if present is None else present.original_of(evaluated)
        flags = update.is_updated_geometry, update.is_updated_transform, update.is_updated_shading
        found.append(Update(type(evaluated), datablock, *flags))
    return found


class _Present:
    """Existing datablocks by the address of their evaluated copies, read per type on demand."""

    def __init__(self, depsgraph):
        self._depsgraph, self._known = depsgraph, {}

    def original_of(self, evaluated):
        """Return the original of an evaluated datablock; None if it was deleted."""
        name = _collection_of(type(evaluated))
        if name is None:
            return None
        if name not in self._known:
            present = getattr(bpy.data, name)
            self._known[name] = {one.evaluated_get(self._depsgraph).as_pointer(): one for one in present}
        return self._known[name].get(evaluated.as_pointer())


@cache
def _collection_of(kind):
    """Return the name of the collection in `bpy.data` for datablocks of a type, or None."""
    held = {p.fixed_type.identifier: p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"}
    return next((held[base.__name__] for base in kind.__mro__ if base.__name__ in held), None)


def originals(updates: list[Update], is_geometry: bool = False, is_transform: bool = False) -> list[bpy.types.ID]:
    """Return the datablocks reported with any of the given kinds of change."""
    wanted = (u for u in updates if (is_geometry and u.is_geometry) or (is_transform and u.is_transform))
    return [update.datablock for update in wanted if update.datablock is not None]


def deformed(updates: list[Update]) -> set[bpy.types.Object]:
    """Return the mesh objects whose evaluated shape may have changed."""
    changed = (u.datablock for u in updates if u.is_geometry and u.is_of(bpy.types.Object) and u.datablock is not None)
    return {one for one in changed if one.type == "MESH"}


def are_only_hair(updates: list[Update]) -> bool:
    """Whether only the geometry of Curves has changed, and not surfaces, lights or the world."""
    # Blender reports no datablock for changes of visibility.
    return len(updates) > 0 and all(map(_are_curves, updates))


def are_only_lamps(updates: list[Update]) -> bool:
    """Whether only lamps and their places have changed."""
    # Blender reports an embedded node tree together with the lamp, material or world that owns it.
    owners = [update for update in updates if not _is_own_tree(update)]
    return len(owners) > 0 and all(
        update.is_of(bpy.types.Light) or type_of_object(update) == "LIGHT" for update in owners
    )


def are_only_hair_in_frame(updates: list[Update]) -> bool:
    """Whether a change of the frame changed only Curves: Blender reports all evaluated datablocks, but no images."""
    if any(image.source in {"SEQUENCE", "MOVIE"} for image in bpy.data.images):
        return False
    others = [update for update in updates if not update.is_of(bpy.types.Action, bpy.types.Camera)]
    return all(_are_curves(update) or type_of_object(update) == "CAMERA" for update in others)


def type_of_object(update: Update) -> str | None:
    """Return Blender's type of an object; None for other datablocks and for deleted objects."""
    return update.datablock.type if update.is_of(bpy.types.Object) and update.datablock is not None else None


def _is_own_tree(update):
    return update.is_of(bpy.types.NodeTree) and (update.datablock is None or update.datablock.is_embedded_data)


def _are_curves(update):
    if update.is_of(bpy.types.Object):
        return type_of_object(update) == "CURVES" and not update.is_transform
    return update.is_of(bpy.types.Curves)
