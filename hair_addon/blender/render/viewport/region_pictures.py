# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the regions of viewports: refined redraw by redraw, and begun anew where something else is to be seen."""

from dataclasses import dataclass

from ...host.caches import Cache
from ..drawn_scene import DrawnScene
from .hair_picture import HairPicture
from .outline import HairOutline
from .selected_hair import LoneOutline
from .view_film import ViewFilm

# (pointer of a region, class of the picture) → RegionPicture: of twelve regions at least, each with a picture and the
# outline over it. Regions come and go without a word.
picture_cache = Cache(capacity=24)


@dataclass
class RegionPicture:
    """A picture of a region, and what it is of."""

    picture: HairPicture | ViewFilm | LoneOutline
    options: tuple  # that it was made with, its size first
    drawn: DrawnScene | None = None
    seen: tuple = ()  # the view, and other options it depends on
    outline: HairOutline | None = None  # of a `HairPicture`, while hair is selected

    def turn_to(self, drawn, seen):
        """Take note of what the picture is to show now; whether that is something else, so that it begins anew."""
        is_other = self.drawn is not drawn or self.seen != seen
        self.drawn, self.seen = drawn, seen
        return is_other


def picture_of(region, kind, *options):
    """The `RegionPicture` of a region, with the picture kind((width, height) [pixels], *options)."""
    key, options = (region.as_pointer(), kind), ((region.width, region.height), *options)
    kept = picture_cache.get(key)
    if kept is None or kept.options != options:
        picture_cache.invalidate(key)
        kept = picture_cache.keep(key, RegionPicture(kind(*options), options))
    return kept


def known_picture(region, kind):
    """The `RegionPicture` of a region as it was drawn last, or None."""
    return picture_cache.get((region.as_pointer(), kind))


def drop_picture(region, kind):
    """Drop a picture that a region does not show any more."""
    picture_cache.invalidate((region.as_pointer(), kind))
