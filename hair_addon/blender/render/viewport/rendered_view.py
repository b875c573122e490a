# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports with Rendered shading: surfaces and hair, refined pass by pass while nothing moves."""

from ...data.pictures import cameras, render_regions
from ...gpu import drawing
from . import hair_picture, live_light, region_pictures, viewport
from .view_film import ViewFilm


def draw(context):
    """Draw the context's viewport; returns whether more passes are needed."""
    with drawing.ALONE:
        drawn, camera = viewport.drawn_scene_of(context), viewport.matrices_of(context.region_data)
        drawn = live_light.lit(context, drawn, camera)
        lens = _lens(context)
        per_side = 1 if lens is not None else hair_picture.samples_per_side()
        options = per_side, _is_transparent(context, drawn)
        region_picture = region_pictures.picture_of(context.region, ViewFilm, *options)
        film = region_picture.picture
        if region_picture.turn_to(drawn, (*map(float, (*camera[0].ravel(), *camera[1].ravel())), lens)):
            film.restart(is_moved=True)
        if not film.is_fine:
            film.add_pass(drawn, *camera, lens)
        film.show(render_regions.read(context.space_data, context.region, context.region_data, context.scene))
        return not film.is_fine and not live_light.is_next(context, film.pass_count)


def _is_transparent(context, drawn):
    """Whether the background is left to Blender: by the film, or since a studio light is not shown in it."""
    has_background = drawn.light.hdri is None or context.space_data.shading.studiolight_background_alpha > 0.0
    return context.scene.render.film_transparent or not has_background


def _lens(context):
    """Return the `Lens` of the camera that a viewport looks through, or None."""
    space, region_view = context.space_data, context.region_data
    if region_view.view_perspective != "CAMERA":
        return None
    camera = space.camera if space.use_local_camera else context.scene.camera
    return cameras.read_lens(context.scene, context.evaluated_depsgraph_get(), camera)
