# SPDX-License-Identifier: GPL-3.0-or-later
"""The draw handler: hair and guides in every 3-D viewport, after Blender's own drawing."""

import bpy
import numpy as np

from ..core.errors import HairError
from . import drawing, hair_cache, scene

# Guides are lines that can be picked out at any distance; strands are never thinner than they can be drawn.
_GUIDE_WIDTH = 2.0
_STRAND_WIDTH = 1.0

_handles = []


def register():
    """Start drawing; in background there is nothing to draw in."""
    if not bpy.app.background:
        _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW"))


def unregister():
    """Stop drawing."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    hair_cache.clear()


def draw():
    """Draw the context's viewport: what changed is uploaded, the rest is on the GPU already."""
    context = bpy.context
    hair = scene.curves_objects(context.view_layer, "HAIR", context.space_data)
    guides = scene.curves_objects(context.view_layer, "GUIDES", context.space_data)
    if not hair and not (guides and context.space_data.overlay.show_overlays):
        return
    depsgraph = context.evaluated_depsgraph_get()
    region_view = context.region_data
    world_to_view = np.array(region_view.view_matrix, np.float64)
    view_to_clip = np.array(region_view.window_matrix, np.float64)
    view = drawing.view_record(world_to_view, view_to_clip, context.region.height, _STRAND_WIDTH)
    view["world_radiance"][:3] = scene.read_world_radiance(context.scene)
    lights = scene.read_lights(depsgraph)
    for hair_object in hair:
        if hair_object.data.vellus.is_drawn:
            _draw(hair_object, hair_cache.hair_on_gpu, view, lights)
    if context.space_data.overlay.show_overlays:
        view = drawing.view_record(world_to_view, view_to_clip, context.region.height, _GUIDE_WIDTH)
        for guide_object in guides:
            _draw(guide_object, hair_cache.guides_on_gpu, view, lights)


def _draw(curves_object, on_gpu, view, lights):
    try:
        strands, shading = on_gpu(curves_object.data)
    except HairError as error:
        # A redraw may not write to the scene: the sentence is told once and nothing is drawn until a change.
        hair_cache.refuse(curves_object.data, error)
        return
    if strands is not None:
        drawing.draw_strands(strands, shading, view, lights, np.array(curves_object.matrix_world, np.float64))
