# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of cards: arrays → images, in files or packed into the .blend."""

from pathlib import Path

import bpy
import numpy as np

from ....core.cards import texels
from ....core.files.atomic_file import atomic_files
from ...host.notices import name_of


def new_images(name, maps):
    """Return {map: image} of `texels.maps`, neither packed nor saved; "color" includes alpha. name: prefix of image
    names.
    """
    pixels = {"color": np.dstack([texels.srgb(maps["color"]), maps["alpha"]])}
    pixels |= {kind: maps[kind] for kind in texels.MAPS if kind != "color"}
    return {kind: _new_image(f"{name} {kind}", kind, values) for kind, values in pixels.items()}


def keep(levels, folder, stem):
    """Pack the images of levels into the .blend, or write them as .png files, all or none. Raises `HairError`.

    levels: [`new_images`]; folder: of the files, None to pack. Files are named after `stem`, the level and the map.
    """
    images = [(f"{stem}{index}_{kind}", image) for index, level in enumerate(levels) for kind, image in level.items()]
    if folder is None:
        for _name, image in images:
            image.pack()
    else:
        _save([image for _name, image in images], [folder / f"{name}.png" for name, _image in images])


def files_of_others(name, folder):
    """Case-folded names of the files in a folder that belong to images whose names do not begin with `name`."""
    others = [image for image in bpy.data.images if image.filepath and not name_of(image).startswith(name)]
    files = [Path(bpy.path.abspath(image.filepath, library=image.library)).resolve() for image in others]
    return {file.name.casefold() for file in files if file.parent == folder.resolve()}


def _new_image(name, kind, values):
    """Return a new image with 8 bits per channel of (n, n), (n, n, 3) or (n, n, 4) values from 0 to 1."""
    size = len(values)
    image = bpy.data.images.new(name, size, size, alpha=kind == "color")
    image.file_format = "PNG"
    image.alpha_mode = "CHANNEL_PACKED"  # colors continue beyond the edges of strands
    if kind != "color":
        image.colorspace_settings.name = "Non-Color"
    rgba = np.ones((size, size, 4), np.float32)
    rgba[..., : values.shape[2] if values.ndim == 3 else 3] = values if values.ndim == 3 else values[..., None]
    image.pixels.foreach_set(rgba.ravel())
    return image


def _save(images, paths):
    with atomic_files(paths) as partials:
        for image, partial in zip(images, partials, strict=True):
            image.filepath_raw = str(partial)
            image.save()
    for image, path in zip(images, paths, strict=True):
        image.filepath_raw = str(path)
        image.source = "FILE"
        image.alpha_mode = "CHANNEL_PACKED"
