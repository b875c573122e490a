# SPDX-License-Identifier: GPL-3.0-or-later
"""References to datablocks by session UID, valid across undo and deletion."""

import bpy

from ...core.errors import HairError
from .notices import name_of


class Remembered:
    """A reference to a datablock by session UID; the datablock may be None."""

    def __init__(self, datablock):
        self._uid = None if datablock is None else datablock.session_uid
        self._name = None if datablock is None else name_of(datablock)
        kinds = {bpy.types.Object: "objects", bpy.types.Scene: "scenes"}
        self._collection = kinds.get(type(datablock), "hair_curves")

    def find(self):
        """Return the datablock. Raises `HairError` if it was deleted."""
        if self._uid is None:
            return None
        found = next((d for d in getattr(bpy.data, self._collection) if d.session_uid == self._uid), None)
        if found is None:
            raise HairError('"{name}" was deleted while hair was being computed.', name=self._name)
        return found
