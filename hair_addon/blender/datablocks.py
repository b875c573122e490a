# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's data across time: references may be dead after an undo or a deletion, a session's number is not."""

import bpy

from ..core.errors import HairError


class Remembered:
    """A datablock to be found again later, or None, which is found as None."""

    def __init__(self, datablock):
        self._uid = None if datablock is None else datablock.session_uid
        self._name = None if datablock is None else datablock.name
        self._collection = "objects" if isinstance(datablock, bpy.types.Object) else "hair_curves"

    def find(self):
        """The datablock as it is now. Raises `HairError` where it was deleted."""
        if self._uid is None:
            return None
        found = next((d for d in getattr(bpy.data, self._collection) if d.session_uid == self._uid), None)
        if found is None:
            raise HairError('"{name}" is gone: it was deleted while hair was computed.', name=self._name)
        return found
