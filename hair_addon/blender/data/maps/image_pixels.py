# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of images and of their UDIM tiles, as core/maps/pixels.py takes them."""

import hashlib
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ....core import maps
from ....core.errors import HairError
from ...host.caches import Cache
from ...host.notices import name_of

# (session_uid of an image, whether as colors) → (digest, {tile: (H, W, C) float32}); cleared if any image changes.
pixel_cache = Cache(capacity=16)


@dataclass(frozen=True, eq=False)
class _Converted:
    """`digests` of the pixels of an image (H, W, C) in Blender, and the converted pixels.

    raw: the array with these pixels, used again by the next read; way: arguments of the conversion; before: the
    converted pixels before the last change; changed: the box of that change.
    """

    digests: np.ndarray
    raw: np.ndarray
    way: dict
    pixels: np.ndarray
    before: np.ndarray | None = None
    changed: tuple[slice, slice] | None = None


# (session_uid of an image, whether as colors) → `_Converted`, which is compared with the present pixels.
converted_cache = Cache(capacity=4)


def read(image, is_color):
    """Return {UDIM tile, or None without tiles: (H, W, C) float32 masks or colors of an image}. Raises `HairError`."""
    if image.source != "TILED" and _may_be_painted(image):
        return {None: _pixels_of(image, image, is_color, is_painted=True)}
    key, digest = (image.session_uid, is_color), _digest(image)
    known = pixel_cache.get(key)
    if known is None or known[0] != digest:
        known = pixel_cache.keep(key, (digest, _read(image, is_color)))
    return known[1]


def load(path):
    """Load an image file, if it is not loaded yet; returns the image's name. Raises `HairError`."""
    try:
        return name_of(bpy.data.images.load(str(Path(path).resolve()), check_existing=True))
    except RuntimeError as error:
        raise HairError('"{path}" cannot be read as an image.', path=path) from error


def _digest(image):
    """Return the source of the pixels; if they may be painted, which Blender may not report, also their digest."""
    kinds = image.source, image.filepath_raw, image.colorspace_settings.name, image.alpha_mode, tuple(image.size)
    if not _may_be_painted(image):
        return kinds
    return *kinds, hashlib.sha1(_raw(image).data, usedforsecurity=False).digest()


def _may_be_painted(image):
    return (image.is_dirty or image.source == "GENERATED") and all(image.size)


def changed_since(before, now):
    """Return the box in which two versions of an image's converted pixels differ; None if they are equal."""
    if before is now:
        return None
    known = (each for each in converted_cache.values() if each.before is before and each.pixels is now)
    return next((each.changed for each in known), None) or maps.pixels.changed_box(before, now)


def _raw(image, into=None):
    """Return the pixels (H, W, C) in Blender; into: an array to fill, if its shape fits."""
    width, height = image.size
    shape = height, width, image.channels
    values = into if into is not None and into.shape == shape else np.empty(shape, np.float32)
    image.pixels.foreach_get(values.ravel())
    return values


def _read(image, is_color):
    if image.source != "TILED":
        return {None: _pixels_of(image, image, is_color)}
    numbers = [tile.number for tile in image.tiles]
    if numbers == [1001]:
        return {1001: _pixels_of(image, image, is_color)}
    return _tiles(image, numbers, is_color)


def _tiles(image, numbers, is_color):
    """Pixels of several tiles, which are read from their files: Blender gives access only to the first tile."""
    with tempfile.TemporaryDirectory() as folder:
        path = bpy.path.abspath(image.filepath_raw, library=image.library)
        if image.is_dirty or not all(Path(_named(path, number)).is_file() for number in numbers):
            path = str(Path(folder) / f"tile.<UDIM>{Path(path).suffix or '.png'}")
            image.save(filepath=path, save_copy=True)
        found = {}
        for number in numbers:
            file = _named(path, number)
            if not Path(file).is_file():
                continue  # a tile without pixels
            tile = bpy.data.images.load(file, check_existing=False)
            try:
                tile.colorspace_settings.name = image.colorspace_settings.name
                tile.alpha_mode = image.alpha_mode
                found[number] = _pixels_of(tile, image, is_color)
            finally:
                bpy.data.images.remove(tile)
    if not found:
        raise _without_pixels(image)
    return found


def _named(path, number):
    return path.replace("<UDIM>", str(number))


def _pixels_of(image, named, is_color, is_painted=False):
    """Converted pixels (H, W, C). Of a painted image only the changed box is converted again."""
    width, height = image.size
    if not (width and height and image.channels):
        raise _without_pixels(named)
    convert = maps.pixels.colors if is_color else maps.pixels.masks
    way = conversion_of(image)
    if not is_painted or max(width, height) > maps.pixels.MOST_SIDE:
        return convert(_raw(image), **way)
    key = image.session_uid, is_color
    known = converted_cache.get(key)
    raw = _raw(image, None if known is None else known.raw)
    digests = maps.pixels.digests(raw)
    if known is None or known.way != way or known.raw.shape != raw.shape:
        return converted_cache.keep(key, _Converted(digests, raw, way, convert(raw, **way))).pixels
    changed = maps.pixels.box_of_changed_parts(known.digests, digests, raw.shape)
    if changed is None:
        return known.pixels
    found = _writable(known)
    maps.pixels.convert_box(raw, changed, found, **way)
    return converted_cache.keep(key, _Converted(digests, raw, way, found, known.pixels, changed)).pixels


def _writable(known):
    """Return a copy of the converted pixels of a `_Converted`, because other users of the image compare with these
    pixels.

    The array before the last change is reused if nothing else refers to it, because it differs only in a box.
    """
    if known.changed is None or sys.getrefcount(known.before) > _REFERENCES:
        return known.pixels.copy()
    found = known.before
    found[known.changed] = known.pixels[known.changed]
    return found


_REFERENCES = 2  # to an array that only a `_Converted` holds, including the argument of `getrefcount`


def conversion_of(image):
    """Return the arguments of `pixels.colors` for an image."""
    return {
        # Blender converts floating-point images while it loads them.
        "is_srgb": not image.is_float and image.colorspace_settings.name == "sRGB",
        "has_alpha": image.alpha_mode in {"STRAIGHT", "PREMUL"},
        "is_premultiplied": image.is_float or image.alpha_mode == "PREMUL",
    }


def _without_pixels(image):
    return HairError('The image "{name}" has no pixels: reload it, or pick another image.', name=name_of(image))
