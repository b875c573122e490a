# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender reports as updated, copied before anything else is done.

Handlers of other add-ons may have run before ours, and deleted what is reported: Blender's reports lead to it all the
same, where its memory was. Its evaluated copy is there, which the depsgraph owns: by it
what is left is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import bpy


@dataclass(frozen=True)
class Update:
    """A report of one datablock.

    datablock: None for what was deleted since, and, where others have run before, for what is part of another one.
    """

    kind: type
    datablock: bpy.types.ID | None
    is_geometry: bool
    is_transform: bool
    is_shading: bool

    def is_of(self, *kinds: type) -> bool:
        """Whether it is of some of Blender's types."""
        return issubclass(self.kind, kinds)


def read(depsgraph: Any, handlers: Sequence[Any], own: Any) -> list[Update]:
    """All reports of an update; handlers: the list of Blender's that `own`, which runs, is in."""
    present = None if handlers[0] is own else _Present(depsgraph)
    found = []
    for update in depsgraph.updates:
        evaluated = update.id
        datablock = evaluated.original if present is None else present.original_of(evaluated)
        flags = update.is_updated_geometry, update.is_updated_transform, update.is_updated_shading
        found.append(Update(type(evaluated), datablock, *flags))
    return found


class _Present:
    """The datablocks that there are, of types that are asked for, by where their evaluated copies are."""

    def __init__(self, depsgraph):
        self._depsgraph, self._known = depsgraph, {}

    def original_of(self, evaluated):
        """The datablock of an evaluated one, None for one that is gone."""
        name = _collection_of(type(evaluated))
        if name is None:
            return None
        if name not in self._known:
            present = getattr(bpy.data, name)
            self._known[name] = {one.evaluated_get(self._depsgraph).as_pointer(): one for one in present}
        return self._known[name].get(evaluated.as_pointer())


@cache
def _collection_of(kind):
    """The name in `bpy.data` of what holds datablocks of a type; None for one that no collection holds."""
    held = {p.fixed_type.identifier: p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"}
    return next((held[base.__name__] for base in kind.__mro__ if base.__name__ in held), None)


def originals(updates: list[Update], is_geometry: bool = False, is_transform: bool = False) -> list[bpy.types.ID]:
    """The datablocks of reports of any of some kinds of change."""
    wanted = (u for u in updates if (is_geometry and u.is_geometry) or (is_transform and u.is_transform))
    return [update.datablock for update in wanted if update.datablock is not None]


def deformed(updates: list[Update]) -> set[bpy.types.Object]:
    """The mesh objects whose evaluated shape may have changed."""
    changed = (u.datablock for u in updates if u.is_geometry and u.is_of(bpy.types.Object) and u.datablock is not None)
    return {one for one in changed if one.type == "MESH"}
