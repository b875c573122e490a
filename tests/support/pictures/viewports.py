# SPDX-License-Identifier: GPL-3.0-or-later
"""3D viewports without a window: Blender's own settings of one, and the context in which it is drawn."""

from types import SimpleNamespace

import bpy


def view3d():
    """Return the first `SpaceView3D` of the file."""
    return next(a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")


def context_of(space, pointer=1, size=(64, 64)):
    """Return a stand-in for the context of a viewport; pointer: of its region."""
    context = bpy.context
    return SimpleNamespace(
        space_data=space,
        region_data=space.region_3d,
        region=SimpleNamespace(as_pointer=lambda: pointer, width=size[0], height=size[1]),
        scene=context.scene,
        view_layer=context.view_layer,
        evaluated_depsgraph_get=context.evaluated_depsgraph_get,
    )
