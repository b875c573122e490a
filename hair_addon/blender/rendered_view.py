# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport that shows what is rendered: surfaces and hair, refined pass by pass while nothing moves."""

from dataclasses import dataclass

from . import drawing, hair_picture, viewport
from .drawn_scene import DrawnScene
from .film import Film

_views = {}  # region → _View

# As many regions as the draw handler keeps pictures of.
_CAPACITY = 12


@dataclass
class _View:
    """The film of a region, and what it is of."""

    film: Film
    drawn: DrawnScene | None = None
    seen: tuple = ()


def draw(context):
    """Draw the context's viewport; returns whether another pass would make it finer."""
    with drawing.ALONE:
        region, is_transparent = context.region, context.scene.render.film_transparent
        drawn, camera = viewport.drawn_scene_of(context), viewport.matrices_of(context.region_data)
        per_side = hair_picture.samples_per_side()
        view = _view_of(region, per_side, is_transparent)
        seen = tuple(map(float, (*camera[0].ravel(), *camera[1].ravel())))
        if view.drawn is not drawn or view.seen != seen:
            view.film.clear()
            view.drawn, view.seen = drawn, seen
        if view.film.sample_count < hair_picture.SAMPLE_COUNT:
            view.film.add_pass(drawn, *camera, view.film.size, view.film.pass_count)
        view.film.show()
        return view.film.sample_count < hair_picture.SAMPLE_COUNT


def _view_of(region, per_side, is_transparent):
    key, size = region.as_pointer(), (region.width, region.height)
    view = _views.pop(key, None)
    if view is None or view.film.size != size or view.film.is_transparent != is_transparent:
        view = _View(Film(size, per_side, ("Combined",), is_transparent))
    _views[key] = view
    while len(_views) > _CAPACITY:
        del _views[next(iter(_views))]
    return view


def clear():
    """Drop all films: the add-on is switched off."""
    _views.clear()
