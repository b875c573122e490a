# SPDX-License-Identifier: GPL-3.0-or-later
"""The draw handler: hair and guides in every 3-D viewport, after Blender's own drawing.

Hair is drawn into a picture of its own and laid over the viewport through the scene's view transform. Surfaces hide it
in that picture, sample by sample: what the viewport itself holds as depth is up to date only while overlays are drawn.
While nothing moves the picture is refined, and once it is fine nothing but the laying over is done.
"""

import sys
from dataclasses import dataclass
from functools import lru_cache

import bpy
import numpy as np

from ..core.errors import HairError
from . import bindings, curves, drawing, drawn_scene, hair_cache, hair_picture, scene, shaders
from .display_transform import DisplayTransform

# Pixels: guides are lines that can be picked out at any distance.
_GUIDE_WIDTH = 2.0

ENGINE = "VELLUS"  # name of our render engine

_handles = []
_drawn = {}  # viewport → DrawnScene, until something moves
_outdated = {}  # viewport → DrawnScene from before its hair changed, and nothing else
_shown = {}  # viewport → what it showed
_pictures = {}  # region → _RegionPicture
_told = set()  # what has been said in the console


# Pictures of this many regions are kept: regions come and go without a word.
_PICTURE_CAPACITY = 12


@dataclass
class _RegionPicture:
    """The picture of a region, and what it is of."""

    picture: hair_picture.HairPicture
    drawn: drawn_scene.DrawnScene | None = None
    seen: tuple = ()  # where from, and whether through surfaces


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
    release()
    _told.clear()


def release():
    """Let go of all that is on the GPU but programs."""
    forget()
    _shown.clear()
    _pictures.clear()
    hair_cache.clear()
    _display_table.cache_clear()


def forget(is_hair_only=False):
    """Something moved: read the scene again with the next redraw. is_hair_only: all but hair is as it was."""
    if is_hair_only:
        _outdated.update(_drawn)
    else:
        _outdated.clear()
    _drawn.clear()


def draw():
    """Draw the context's viewport. What changed since the last time is uploaded, the rest is on the GPU already.

    Nothing that is wrong with hair may keep the viewport from being drawn: it is said once, and the hair is left out.
    """
    context = bpy.context
    with drawing.ALONE:
        _draw(context)


def _draw(context):
    try:
        if context.space_data.shading.type != "RENDERED":  # there the render engine draws hair by itself
            _draw_hair(context)
        if context.space_data.overlay.show_overlays:
            _draw_guides(context)
    except HairError as error:
        if str(error) not in _told:
            _told.add(str(error))
            print(f"Vellus: {error}", file=sys.stderr)


def _draw_hair(context):
    viewport, region = context.space_data, context.region
    drawn = drawn_scene_of(context)
    if not drawn.hair:
        return
    xray = _xray(viewport.shading)
    picture = _picture(drawn, context.region_data, region, is_see_through=xray is not None)
    picture.show(
        _display_table(DisplayTransform.of(context.scene)),
        2.0**context.scene.view_settings.exposure,
        1.0 if xray is None else xray,
        "LESS_EQUAL" if viewport.overlay.show_overlays and xray is None else "ALWAYS",
    )
    if not picture.is_fine:
        region.tag_redraw()


def is_ours(context):
    """Whether all of a viewport is drawn by our render engine."""
    return context.space_data.shading.type == "RENDERED" and context.scene.render.engine == ENGINE


def hair_at(context, x, y):
    """The hair object that the context's viewport shows at a pixel of its region, or None."""
    kept = _pictures.get(context.region.as_pointer())
    width, height = kept.picture.size if kept else (0, 0)
    if context.space_data.shading.type == "RENDERED" or not (0 <= x < width and 0 <= y < height):
        return None
    if kept.drawn is not _drawn.get(context.space_data.as_pointer()):
        return None  # what is seen there is about to be drawn again
    index = kept.picture.hair_at(x, y)
    uid = None if index is None else kept.drawn.owners[index]
    return next((o for o in context.view_layer.objects if o.session_uid == uid), None)


def drawn_scene_of(context):
    """The `DrawnScene` of the context's viewport, read if something has moved."""
    viewport = context.space_data
    key, shows = viewport.as_pointer(), (is_ours(context), *_what_shows(viewport))
    if _shown.get(key) != shows:
        # What one viewport leaves out is no change of the scene.
        _drawn.pop(key, None), _outdated.pop(key, None)
        _shown[key] = shows
    if key not in _drawn:
        _drawn[key] = drawn_scene.read(
            context.scene,
            context.view_layer,
            context.evaluated_depsgraph_get(),
            viewport,
            hair_cache.refuse,
            before=_outdated.pop(key, None),
            is_draft=bindings.has_unwritten(),
            is_hair_only=not is_ours(context),
        )
    return _drawn[key]


def _what_shows(viewport):
    """All by which a viewport leaves out objects that others show."""
    return (
        viewport.local_view is not None,
        viewport.use_local_collections,
        viewport.show_object_viewport_mesh,
        viewport.show_object_viewport_curves,
    )


def _xray(shading):
    """How opaque things are in an X-ray view, from 0 to 1; None where surfaces hide what is behind them."""
    if shading.type == "WIREFRAME":
        return shading.xray_alpha_wireframe if shading.show_xray_wireframe else None
    return shading.xray_alpha if shading.type == "SOLID" and shading.show_xray else None


def _picture(drawn, view, region, is_see_through):
    """The `HairPicture` of a region, of this scene from here: begun anew, with a pass more, or as it is."""
    key, size = region.as_pointer(), (region.width, region.height)
    kept = _pictures.pop(key, None)
    if kept is None or kept.picture.size != size:
        kept = _RegionPicture(hair_picture.HairPicture(*size))
    _pictures[key] = kept
    while len(_pictures) > _PICTURE_CAPACITY:
        del _pictures[next(iter(_pictures))]
    seen = (is_see_through, *map(tuple, view.view_matrix), *map(tuple, view.window_matrix))
    if kept.drawn is not drawn or kept.seen != seen:
        kept.picture.restart()
        kept.drawn, kept.seen = drawn, seen
    if not kept.picture.is_fine:
        kept.picture.add_pass(drawn, *matrices_of(view), is_see_through)
    return kept.picture


def matrices_of(view):
    """(world to view, view to clip) of a `RegionView3D`, each (4, 4) float64."""
    return np.array(view.view_matrix, np.float64), np.array(view.window_matrix, np.float64)


@lru_cache(maxsize=4)
def _display_table(transform):
    return hair_picture.table_texture(transform.table())


def _draw_guides(context):
    viewport = context.space_data
    guide_objects = scene.curves_objects(context.view_layer, "GUIDES", viewport)
    if guide_objects:
        lights = drawn_scene_of(context).lights
        view = drawing.view_record(*matrices_of(context.region_data), context.region.height, _GUIDE_WIDTH)
        for guide_object in guide_objects:
            _draw_guide_object(guide_object, view, lights)


def _draw_guide_object(guide_object, view, lights):
    try:
        guides = hair_cache.strands_on_gpu(guide_object.data)
    except HairError as error:
        hair_cache.refuse(guide_object.data, error)
        return
    if guides is not None:
        program = shaders.strip_program("guides.frag")
        with drawing.gpu_state("LESS_EQUAL", depth_writes=True):
            drawing.draw_strands(guides, program, view, lights, np.array(guide_object.matrix_world, np.float64))
