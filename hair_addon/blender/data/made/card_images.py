# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of cards: arrays → images, in files or packed into the .blend."""

from pathlib import Path

import bpy
import numpy as np

from ....core.cards import texels, texture_layouts
from ....core.files.atomic_file import atomic_files
from ...host.notices import name_of


def new_images(name, maps, layout, roughness):
    """Return {map: image} of `TexelSums.maps` and of a layout, neither packed nor saved; "color" includes alpha.

    The channels of "roughness", if strands differ in it, are those of glTF: 1, roughness of a surface, 0 (metallic).
    name: prefix of image names; layout: of `CardSettings`; roughness: of the look.
    """
    pixels = {"color": np.dstack([texels.srgb(maps["color"]), maps["alpha"]])}
    pixels |= {kind: maps[kind] for kind in texels.MAPS if kind != "color"}
    if "roughness" in maps:
        of_surface = texture_layouts.surface_roughness(maps["roughness"])
        pixels["roughness"] = np.dstack([np.ones_like(of_surface), of_surface, np.zeros_like(of_surface)])
    pixels |= texture_layouts.packed(maps, layout, roughness)
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
    """Return a new image with 8 bits per channel of (n, n) or (n, n, k) values from 0 to 1, with k = 1, 3 or 4."""
    values, size = values.reshape(*values.shape[:2], -1), len(values)
    image = bpy.data.images.new(name, size, size, alpha=values.shape[2] == 4)
    image.file_format = "PNG"
    image.alpha_mode = "CHANNEL_PACKED"  # colors continue beyond the edges of strands
    if not texture_layouts.has_color(kind):
        image.colorspace_settings.name = "Non-Color"
    rgba = np.ones((size, size, 4), np.float32)
    rgba[..., : max(values.shape[2], 3)] = values
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
