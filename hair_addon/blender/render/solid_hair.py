# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of objects in the colors of a viewport's color type, and by its matcap."""

from dataclasses import dataclass

import gpu
import numpy as np

from ..data.pictures import object_colors, root_colors
from ..gpu import solid_shading, studio_lights
from ..host.caches import Cache


@dataclass(frozen=True, eq=False)
class _Tints:
    """Colors (S, 3) of strands, and the same as a texture."""

    colors: np.ndarray
    row_strands: int
    texture: gpu.types.GPUTexture


# (session_uid of an object, color type) → `_Tints`, which are compared: the same colors are the same texture.
tint_cache = Cache(capacity=16)


def make_room(count):
    """Keep the colors of `count` objects, which are read in turn."""
    for cache in (tint_cache, solid_shading.shading_cache):
        cache.make_room(count)


def is_tinted(shown):
    """Whether a `viewport_shading.ViewportShading` replaces the color of all looks."""
    return shown.color.kind in {"SINGLE", "OBJECT", "RANDOM"}


def has_root_colors(shown):
    """Whether a `viewport_shading.ViewportShading` shows the colors of surfaces at roots, where surfaces have them."""
    return shown.color.kind in {root_colors.ATTRIBUTE, root_colors.TEXTURE}


def strand_tints(shown, hair_object, depsgraph, strands, places):
    """Return the texture of colors of `StrandsOnGPU` by their roots, or None; places: as of `root_colors.at_roots`."""
    kind = shown.color.kind
    colors = root_colors.at_roots(hair_object, depsgraph, kind, places, strands.points[:, 0])
    if colors is None:
        return None
    key = hair_object.session_uid, kind
    known = tint_cache.get(key)
    if known is None or known.row_strands != strands.row_strands or not np.array_equal(known.colors, colors):
        texture = solid_shading.tint_texture(colors, strands.row_strands)
        known = tint_cache.keep(key, _Tints(colors, strands.row_strands, texture))
    return known.texture


def shown_as(shading, shown, hair_object, tints=None):
    """Return the `Shading` of an object's hair as a `ViewportShading` shows it; tints: from `strand_tints`.

    Raises `HairError`.
    """
    matcap = studio_lights.image_of(shown.light.matcap) if shown.light.matcap else None
    tint = object_colors.color_of(hair_object, shown.color) if is_tinted(shown) else (1.0, 1.0, 1.0)
    has_highlights = shown.light.has_highlights or matcap is None
    return solid_shading.shown_as(shading, solid_shading.Solid(tint, tints, matcap, has_highlights))
