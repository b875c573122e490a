# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of viewport regions: refined with each redraw, and restarted when their content changes."""

from dataclasses import dataclass

from ...host.caches import Cache
from ..drawn_scene import DrawnScene
from .hair_picture import HairPicture
from .outline import HairOutline
from .selected_hair import LoneOutline
from .view_film import ViewFilm

# (pointer of a region, class of the picture) → RegionPicture: for at least twelve regions, each with a picture and an
# outline. Blender does not report removed regions.
picture_cache = Cache(capacity=24)


@dataclass
class RegionPicture:
    """A picture of a region, and its content."""

    picture: HairPicture | ViewFilm | LoneOutline
    options: tuple  # of the picture's constructor, its size first
    drawn: DrawnScene | None = None
    seen: tuple = ()  # the view, and other options that the picture depends on
    outline: HairOutline | None = None  # of a `HairPicture`, while hair is selected

    def turn_to(self, drawn, seen):
        """Set the content of the picture; returns whether it has changed, so that the picture must be restarted."""
        is_other = self.drawn is not drawn or self.seen != seen
        self.drawn, self.seen = drawn, seen
        return is_other


def picture_of(region, kind, *options):
    """Return the `RegionPicture` of a region, with the picture kind((width, height) [pixels], *options)."""
    key, options = (region.as_pointer(), kind), ((region.width, region.height), *options)
    known = picture_cache.get(key)
    if known is None or known.options != options:
        picture_cache.invalidate(key)
        known = picture_cache.keep(key, RegionPicture(kind(*options), options))
    return known


def known_picture(region, kind):
    """Return the last drawn `RegionPicture` of a region, or None."""
    return picture_cache.get((region.as_pointer(), kind))


def drop_picture(region, kind):
    """Drop a picture that a region no longer shows."""
    picture_cache.invalidate((region.as_pointer(), kind))
