# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports with Rendered shading: surfaces and hair, refined pass by pass while nothing moves."""

from ..gpu import drawing
from . import hair_picture, region_pictures, viewport
from .film import Film


def draw(context):
    """Draw the context's viewport; returns whether another pass would make it finer."""
    with drawing.ALONE:
        drawn, camera = viewport.drawn_scene_of(context), viewport.matrices_of(context.region_data)
        options = hair_picture.samples_per_side(), ("Combined",), context.scene.render.film_transparent
        kept = region_pictures.picture_of(context.region, Film, *options)
        film = kept.picture
        if kept.turn_to(drawn, tuple(map(float, (*camera[0].ravel(), *camera[1].ravel())))):
            film.clear()
        if film.sample_count < hair_picture.SAMPLE_COUNT:
            film.add_pass(drawn, *camera, film.size, film.pass_count)
        film.show()
        return film.sample_count < hair_picture.SAMPLE_COUNT
