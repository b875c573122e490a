# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of a file in new files that append it and that link it."""

from collections.abc import Iterator

import bpy
from bpy.types import Curves


def in_new_files(path: str) -> Iterator[Curves]:
    """Append, then link, the object "Hair" of a .blend in a new file each, and yield its Curves in the open file."""
    for is_linked in (False, True):
        bpy.ops.wm.read_homefile(use_empty=True)
        with bpy.data.libraries.load(path, link=is_linked) as (_there, here):
            here.objects = ["Hair"]
        bpy.context.collection.objects.link(here.objects[0])
        bpy.context.view_layer.update()
        (found,) = (one for one in bpy.data.hair_curves if one.name == "Hair")
        yield found
