# SPDX-License-Identifier: GPL-3.0-or-later
"""The draw handler: hair and guides in every 3D viewport, after Blender's own drawing.

Hair is drawn into a separate picture, which is composited over the viewport through the scene's view transform.
Surfaces occlude hair in that picture, sample by sample, as the viewport's own depth is only up to date while overlays
are drawn. While nothing moves the picture is refined, and then only composited.
"""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ....core.errors import HairError
from ...data import scene
from ...data.pictures import render_regions, viewport_shading
from ...data.strands import curves_objects
from ...gpu import drawing
from ...gpu.display_transform import DisplayTransform
from ...groom import bindings, hidden_hair
from ...host import scene_time
from ...host.caches import Cache
from ...host.engines import ENGINE
from ...host.notices import say
from .. import drawn_scene, hair_cache, late_layers
from . import guide_lines, hair_picture, live_light, region_pictures, selected_hair
from .outline import HairOutline

_PICK_REACH = 5  # maximum distance [pixels] of a click from hair, as strands are thinner than a pixel
_WIRE_OPACITY = 0.5  # minimum opacity of hair in Wireframe shading

_handles = []  # of draw handlers

view_cache = Cache()  # pointer of a viewport → _View
display_table_cache = Cache(capacity=4)  # DisplayTransform → texture


@dataclass
class _View:
    """The cached scene of a viewport until something moves."""

    shows: tuple  # key of the viewport's settings that decide what is read
    drawn: drawn_scene.DrawnScene | None = None
    lit: dict = field(default_factory=dict)  # pointer of a region → `drawn` in the light of the region's view
    wanted: dict = field(default_factory=dict)  # the same → the light of its last redraw
    outdated: drawn_scene.DrawnScene | None = None  # the previous scene, if only hair has changed
    unlit: drawn_scene.DrawnScene | None = None  # the previous scene, if only lamps have changed
    former: drawn_scene.DrawnScene | None = None  # the previous scene
    is_playing: bool = False  # whether it was read during playback, or while a surface was being moved


def register():
    """Start drawing in every 3D viewport."""
    _handles.append(bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW"))


def unregister():
    """Stop drawing, and leave hair and guides to Blender's own drawing."""
    live_light.unregister()
    for datablock in bpy.data.hair_curves:
        if datablock.vellus.kind != "NONE":
            curves_objects.draw_natively(datablock, True)
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def is_up_to_date():
    """Whether a viewport has drawn its scene since something changed."""
    return any(view.drawn is not None for view in view_cache.values())


def invalidate(is_hair_only=False, is_light_only=False):
    """Read the scene again with the next redraw, as something has changed; is_hair_only: only hair has changed;
    is_light_only: only lamps have changed.
    """
    for view in view_cache.values():
        view.former = view.drawn or view.former
        view.outdated = (view.drawn or view.outdated) if is_hair_only else None
        view.unlit = (view.drawn or view.unlit) if is_light_only else None
        view.drawn = None
        view.lit.clear()


def draw():
    """Draw the context's viewport. Only changes are uploaded to the GPU.

    Errors of hair must not prevent drawing the viewport: they are reported once, and the hair is skipped.
    """
    context = bpy.context
    with drawing.ALONE:
        _draw(context)


def _draw(context):
    try:
        if is_drawn_by_engine(context):
            _draw_outline(context)
        else:
            _draw_hair(context)
        if context.space_data.overlay.show_overlays:
            _draw_guides(context)
    except HairError as error:
        say(str(error))


def _draw_hair(context):
    viewport, region = context.space_data, context.region
    drawn = drawn_scene_of(context)
    if not drawn.hair:
        live_light.drop(context.region.as_pointer())
        return
    xray = _xray(context)
    outlined = selected_hair.outlined(context, drawn, is_see_through=xray is not None)
    drawn = live_light.lit(context, drawn, matrices_of(context.region_data))
    clip_planes = _clip_planes(context)
    is_shadowed = _is_shadowed(context, drawn) and clip_planes is None
    region_picture = _picture(drawn, context.region_data, region, xray is not None, outlined, is_shadowed, clip_planes)
    management = viewport_shading.read(viewport, context.scene, matrices_of(context.region_data)[0]).management
    region_picture.picture.show(
        _display_table(DisplayTransform.of(context.scene, management)),
        2.0**context.scene.view_settings.exposure if management == viewport_shading.ALL else 1.0,
        1.0 if xray is None else xray,
        "LESS_EQUAL" if viewport.overlay.show_overlays and xray is None else "ALWAYS",
        _border(context),
    )
    if region_picture.outline is not None:
        region_picture.outline.show()
    # At rest, programs for the next edit are compiled, one per redraw, as each may take a second.
    picture = region_picture.picture
    is_waiting = picture.is_fine or live_light.is_next(context, picture.pass_count)
    if not is_waiting or hair_cache.prepare_makers():
        region.tag_redraw()


def _draw_outline(context):
    """Draw the outline of selected hair over a render engine's picture."""
    region, wanted = context.region, None
    if selected_hair.may_be_outlined(context):
        drawn = drawn_scene_of(context)
        wanted = selected_hair.outlined(context, drawn)
    if wanted is None:
        region_pictures.drop_picture(region, selected_hair.LoneOutline)
        return
    region_picture = region_pictures.picture_of(region, selected_hair.LoneOutline)
    outline, matrices = region_picture.picture, matrices_of(context.region_data)
    if region_picture.turn_to(drawn, (wanted, *(tuple(map(float, matrix.ravel())) for matrix in matrices))):
        outline.restart(dict(wanted[0]), wanted[1])
    if not outline.is_fine:
        outline.add_pass(drawn, *matrices)
    outline.show()
    if not outline.is_fine:
        region.tag_redraw()


def is_drawn_by_engine(context):
    """Whether a render engine draws the hair of a viewport: all engines but Workbench, which hides it."""
    return context.space_data.shading.type == "RENDERED" and context.scene.render.engine != "BLENDER_WORKBENCH"


def is_ours(context):
    """Whether all of a viewport is drawn by our render engine."""
    return context.space_data.shading.type == "RENDERED" and context.scene.render.engine == ENGINE


def hair_at(context, x, y):
    """Return the hair object in the context's viewport at, or a few pixels from, a pixel of its region; or None."""
    region_picture = region_pictures.known_picture(context.region, hair_picture.HairPicture)
    width, height = region_picture.picture.size if region_picture else (0, 0)
    if is_drawn_by_engine(context) or not (0 <= x < width and 0 <= y < height):
        return None
    view = view_cache.get(context.space_data.as_pointer())
    known = None if view is None else view.lit.get(context.region.as_pointer())
    if known is None or region_picture.drawn.hair is not known.hair:
        return None  # the picture is outdated and about to be redrawn
    index = region_picture.picture.hair_near(x, y, round(_PICK_REACH * context.preferences.system.ui_scale))
    uid = None if index is None else region_picture.drawn.owners[index]
    return next((o for o in context.view_layer.objects if o.session_uid == uid), None)


def drawn_scene_of(context):
    """Return the `DrawnScene` of the context's viewport, read if something has moved."""
    if late_layers.has_new():
        invalidate(is_hair_only=True)
    viewport = context.space_data
    shading = viewport_shading.read(viewport, context.scene, matrices_of(context.region_data)[0])
    key, shows = viewport.as_pointer(), (is_ours(context), *_visibility_key(viewport), shading.strands)
    view = view_cache.get(key)
    if view is None or view.shows != shows:  # settings of a viewport do not change the scene
        view = view_cache.keep(key, _View(shows))
    is_playing = scene_time.is_playing() or hidden_hair.is_any_paused()
    is_rough = view.is_playing and not is_playing  # at rest the scene is read again in full detail
    if view.drawn is not None and (is_rough or not drawn_scene.has_room(view.drawn)):
        view.outdated, view.drawn = view.drawn, None
        view.lit.clear()
    if view.drawn is None:
        before, view.outdated = view.outdated, None
        former, view.former = view.former, None
        unlit, view.unlit = view.unlit, None
        if unlit is not None and unlit.hair and view.is_playing == is_playing:
            view.drawn = _relit(context, unlit)
            return _lit(view, context, shading.light)
        view.is_playing = is_playing
        depsgraph = context.evaluated_depsgraph_get()
        with scene.meshes_read_once():
            view.drawn = drawn_scene.read(
                context.scene,
                context.view_layer,
                depsgraph,
                viewport,
                hair_cache.refuse,
                before=before,
                is_draft=bindings.has_unwritten(),
                is_hair_only=not is_ours(context),
                former=former if is_playing else None,
                shown=shading,
            )
        if view.drawn.hair:
            hair_cache.choose_makers()
    return _lit(view, context, shading.light)


def _relit(context, drawn):
    """Return a `DrawnScene` of the context's viewport after changes of lamps alone, with the same hair and surfaces."""
    depsgraph, maps = context.evaluated_depsgraph_get(), drawn.shadow_maps
    return drawn_scene.relit(drawn, context.scene, context.view_layer, depsgraph, drawn.light, maps, is_ours(context))


def _lit(view, context, light):
    """Return the `DrawnScene` of a `_View` in the light of the context's region, and keep it in the view.

    Regions of a viewport, as in a quad view, differ in lights that follow the view. While the view turns, lights
    follow in steps, as each step draws shadow maps.
    """
    region = context.region.as_pointer()
    known = view.lit.get(region, view.drawn)
    is_turning = view.wanted.get(region) != light
    view.wanted[region] = light
    is_late = is_turning and viewport_shading.is_near(known.light, light)
    if known.light != light and known.hair and not is_late:
        maps = known.shadow_maps if _is_lone(view, region, known) else None
        turned = drawn_scene.relit(
            known, context.scene, context.view_layer, context.evaluated_depsgraph_get(), light, maps, is_ours(context)
        )
        if maps is not None and view.drawn is known:
            view.drawn = turned  # the maps of `known` are drawn over
        known = turned
    view.lit[region] = known
    return known


def _is_lone(view, region, drawn):
    """Whether no other region shows a `DrawnScene`."""
    return all(other is not drawn for pointer, other in view.lit.items() if pointer != region)


def _visibility_key(viewport):
    """Return a key of a viewport's settings that affect which objects, and which of their data, are read."""
    return (
        viewport.shading.type == "MATERIAL",
        viewport.local_view is not None,
        viewport.use_local_collections,
        viewport.show_object_viewport_mesh,
        viewport.show_object_viewport_curves,
    )


def _xray(context):
    """Opacity of the X-ray view, from 0 to 1; None if surfaces occlude."""
    shading = context.space_data.shading
    if shading.type == "WIREFRAME":
        # The opacity of surfaces, whose wires are visible at 0 too.
        return (
            _WIRE_OPACITY + (1.0 - _WIRE_OPACITY) * shading.xray_alpha_wireframe
            if shading.show_xray_wireframe
            else None
        )
    if shading.type == "RENDERED" and not is_drawn_by_engine(context):
        shading = context.scene.display.shading
    elif shading.type != "SOLID":
        return None
    return shading.xray_alpha if shading.show_xray else None


def _is_shadowed(context, drawn):
    """Whether hair darkens surfaces: its own in Solid shading, and by a setting all of Material Preview."""
    if context.space_data.shading.type == "MATERIAL":
        return context.scene.vellus.has_preview_shadow
    return not drawn.is_wire and any(drawn.is_shadowed)


def _clip_planes(context):
    """Return ((x, y, z, w), ... of six planes) of Blender's Clipping Region in Wireframe and Solid shading, or None.

    World points p with any dot((x, y, z, w), (p, 1)) < 0 are clipped.
    """
    view = context.region_data
    if not view.use_clip_planes or context.space_data.shading.type not in {"WIREFRAME", "SOLID"}:
        return None
    planes = tuple(map(tuple, view.clip_planes))
    return (*planes[:4], *[(0.0, 0.0, 0.0, 0.0)] * 2) if view.use_box_clip else planes  # quad views clip by four planes


def _border(context):
    """Return the Render Region that Material Preview is limited to, as `render_regions.read`, or None."""
    if context.space_data.shading.type != "MATERIAL":
        return None
    return render_regions.read(context.space_data, context.region, context.region_data, context.scene)


def _picture(drawn, view, region, is_see_through, outlined=None, is_shadowed=False, clip_planes=None):
    """Return the `RegionPicture` of a region for this scene and view: restarted, with another pass, or unchanged.

    outlined: from `selected_hair.outlined`; is_shadowed, clip_planes: as for `HairPicture.add_pass`.
    """
    region_picture = region_pictures.picture_of(region, hair_picture.HairPicture)
    options = is_see_through, is_shadowed, clip_planes
    is_moved = region_picture.seen[:3] == options
    seen = (*options, outlined, *map(tuple, view.view_matrix), *map(tuple, view.window_matrix))
    if region_picture.turn_to(drawn, seen):
        region_picture.picture.restart(is_moved)
        if outlined is None:
            region_picture.outline = None
        else:
            region_picture.outline = region_picture.outline or HairOutline(region_picture.picture.size)
            region_picture.outline.restart(dict(outlined[0]), outlined[1])
    if not region_picture.picture.is_fine:
        options = is_see_through, region_picture.outline, is_shadowed, clip_planes
        region_picture.picture.add_pass(drawn, *matrices_of(view), *options)
    return region_picture


def matrices_of(view):
    """Return (world to view, view to clip) of a `RegionView3D`, each (4, 4) float64."""
    return np.array(view.view_matrix, np.float64), np.array(view.window_matrix, np.float64)


def _display_table(transform):
    return display_table_cache.get(transform, lambda: hair_picture.table_texture(transform.table()))


def _draw_guides(context):
    if guide_objects := guide_lines.shown(context):
        lights = drawn_scene_of(context).lights
        view = drawing.view_record(*matrices_of(context.region_data), context.region.height, guide_lines.strip_width())
        for guide_object in guide_objects:
            guide_lines.draw(guide_object, view, lights, _clip_planes(context))
