# SPDX-License-Identifier: GPL-3.0-or-later
"""Mean colors of images over surfaces, for the light that surfaces reflect."""

from dataclasses import dataclass

import bpy
import numpy as np

from ....core import maps
from ....core.imaging import texture_means
from ...host import scene_time
from ...host.caches import Cache
from ..maps import image_pixels

_SIDE = 512  # texels along a side of reduced pictures

# session_uid of an image → (its settings, (H, W, 4) float32); cleared when images change
picture_cache = Cache(capacity=64)
mean_cache = Cache(capacity=64)  # (session_uid of an image, number of corners) → `_Known`


@dataclass(frozen=True, eq=False)
class ImageMeans:
    """Mean colors of an image. of_triangles: (F, 3) float32; of_part: linear RGB of all triangles together."""

    of_triangles: np.ndarray
    of_part: tuple


@dataclass(frozen=True, eq=False)
class _Known:
    """Inputs of `ImageMeans` at their last use. picture: the array of pixels, which a change replaces."""

    picture: np.ndarray
    image_map: object
    uvs: np.ndarray
    means: ImageMeans

    def fits(self, picture, image_map, uvs):
        own, other = self.image_map, image_map
        return (
            self.picture is picture
            and (own.extension, own.is_opaque) == (other.extension, other.is_opaque)
            and np.array_equal(own.rows, other.rows)
            and np.array_equal(self.uvs, uvs)
        )


def of_image(image_map, uvs):
    """Return the `ImageMeans` of a `surface_materials.ImageMap` over triangles; None if its pixels cannot be read.

    uvs: (3 F, 2) of the corners of the triangles.
    """
    image = image_map.image
    is_baked = not isinstance(image, bpy.types.Image)
    picture = image.texels if is_baked else _picture_of(image)
    if picture is None:
        return None
    key = id(image) if is_baked else image.session_uid, len(uvs)
    known = mean_cache.get(key)
    if known is None or not known.fits(picture, image_map, uvs):
        drawn = picture if is_baked else _as_drawn(picture, image, image_map)
        placed = uvs @ image_map.rows[:, :2].T + image_map.rows[:, 2]
        means = texture_means.triangle_means(drawn, placed, image_map.extension)
        means = ImageMeans(means[:, :3], _of_part(means[:, :3], uvs))
        known = mean_cache.keep(key, _Known(picture, image_map, uvs, means))
    return known.means


def _picture_of(image):
    """Return (H, W, 4) float32 premultiplied linear colors of an image, reduced to `_SIDE`; None without pixels."""
    if not (all(image.size) and image.channels):
        return None
    # Blender may not report changes of these. Nobody paints while the animation plays.
    is_painted = (image.is_dirty or image.source == "GENERATED") and not scene_time.is_shown_moving()
    kinds = image.filepath_raw, image.colorspace_settings.name, image.alpha_mode, tuple(image.size)
    known = picture_cache.get(image.session_uid)
    if known is not None and known[0] == kinds and not is_painted:
        return known[1]
    width, height = image.size
    raw = np.empty((height, width, image.channels), np.float32)
    image.pixels.foreach_get(raw.ravel())
    picture = maps.pixels.colors(_reduced(raw), **image_pixels.conversion_of(image))
    if known is not None and np.array_equal(known[1], picture):
        picture = known[1]
    return picture_cache.keep(image.session_uid, (kinds, picture))[1]


def _reduced(raw):
    """Return a picture that is larger than `_SIDE` with two by two pixels of each of its blocks.

    Pixels are picked at random, because patterns of bricks or threads may repeat with the blocks.
    """
    height, width = raw.shape[:2]
    step = -(-max(height, width) // _SIDE)
    if step <= 2:
        return raw
    rows, columns = np.meshgrid(np.arange(height // step * 2), np.arange(width // step * 2), indexing="ij")
    picked = np.random.default_rng(0).integers(0, step, (2, *rows.shape))
    return raw[
        np.minimum(rows // 2 * step + picked[0], height - 1), np.minimum(columns // 2 * step + picked[1], width - 1)
    ]


def _as_drawn(picture, image, image_map):
    """Return the colors of a picture as shaders read them, premultiplied unless the image is opaque."""
    if not image_map.is_opaque or image.is_float or image.alpha_mode != "STRAIGHT":
        return picture
    return maps.pixels.unpremultiplied(picture.reshape(-1, 4))[0].reshape(*picture.shape[:2], 3)


def _of_part(means, uvs):
    """Return the mean color of triangles (F, 3) with UVs (3 F, 2), weighted by their areas in the UV map.

    These areas stay the same while a surface deforms.
    """
    first, second, third = uvs.reshape(-1, 3, 2).transpose(1, 0, 2).astype(np.float64)
    (u, v), (x, y) = (second - first).T, (third - first).T
    areas = np.abs(u * y - v * x)
    total = areas.sum()
    weighted = areas @ means / total if 0.0 < total < np.inf else means.mean(axis=0)
    return tuple(float(value) for value in weighted)
