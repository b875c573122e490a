# SPDX-License-Identifier: GPL-3.0-or-later
"""The draw handler: hair and guides in every 3-D viewport, after Blender's own drawing."""

import bpy
import numpy as np

from ..core.errors import HairError
from . import curves, drawing, drawn_scene, hair_cache, scene

# Pixels: guides are lines that can be picked out at any distance, strands never fall between two pixels.
_GUIDE_WIDTH = 2.0
_STRAND_WIDTH = 1.0

_handles = []
_drawn = {}  # viewport → DrawnScene, until something moves


def register():
    """Start drawing in every 3-D viewport that there is."""
    _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW"))


def unregister():
    """Stop drawing, and leave hair to Blender's own drawing."""
    for datablock in bpy.data.hair_curves:
        if datablock.vellus.kind == "HAIR":
            curves.draw_natively(datablock, True)
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    forget()
    hair_cache.clear()


def forget():
    """Something moved: read the scene again with the next redraw."""
    _drawn.clear()


def draw():
    """Draw the context's viewport. What changed since the last time is uploaded, the rest is on the GPU already."""
    context = bpy.context
    viewport = context.space_data
    world_to_view = np.array(context.region_data.view_matrix, np.float64)
    view_to_clip = np.array(context.region_data.window_matrix, np.float64)
    key = viewport.as_pointer()
    if key not in _drawn:
        _drawn[key] = drawn_scene.read(
            context.scene, context.view_layer, context.evaluated_depsgraph_get(), viewport, hair_cache.refuse
        )
    drawn = _drawn[key]
    drawn_scene.draw_hair(drawn, drawing.view_record(world_to_view, view_to_clip, context.region.height, _STRAND_WIDTH))
    if viewport.overlay.show_overlays:
        view = drawing.view_record(world_to_view, view_to_clip, context.region.height, _GUIDE_WIDTH)
        for guide_object in scene.curves_objects(context.view_layer, "GUIDES", viewport):
            _draw_guides(guide_object, view, drawn.lights)


def _draw_guides(guide_object, view, lights):
    try:
        guides, shading = hair_cache.guides_on_gpu(guide_object.data)
    except HairError as error:
        hair_cache.refuse(guide_object.data, error)
        return
    if guides is not None:
        with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            drawing.draw_strands(guides, shading, view, lights, np.array(guide_object.matrix_world, np.float64))
