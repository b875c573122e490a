# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of objects in the colors of a viewport's color type, and by its matcap."""

from ..data.pictures import object_colors
from ..gpu import solid_shading, studio_lights


def is_tinted(shown):
    """Whether a `viewport_shading.ViewportShading` replaces the color of looks."""
    return shown.color.kind in {"SINGLE", "OBJECT", "RANDOM"}


def shown_as(shading, shown, hair_object):
    """The `Shading` of an object's hair as a `ViewportShading` shows it. Raises `HairError`."""
    matcap = studio_lights.image_of(shown.light.matcap) if shown.light.matcap else None
    tint = object_colors.color_of(hair_object, shown.color) if is_tinted(shown) else (1.0, 1.0, 1.0)
    solid = solid_shading.Solid(tint, matcap=matcap, has_highlights=shown.light.has_highlights or matcap is None)
    return solid_shading.shown_as(shading, solid)
