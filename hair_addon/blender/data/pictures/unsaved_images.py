# SPDX-License-Identifier: GPL-3.0-or-later
"""Images with unsaved pixels, such as painted ones: a .blend for another process does not contain the pixels."""

import hashlib

import bpy
import numpy as np

from .shader_sockets import nodes_of

_FILE = "images.npz"


def pixels_of(image):
    """Return the pixels of an image (H, W, C) float32 if they are not saved, None otherwise."""
    if not (image.is_dirty and all(image.size) and image.channels):
        return None
    pixels = np.empty((*image.size[::-1], image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels


def digest_of(image):
    """Return a digest of unsaved pixels, None for a saved image."""
    pixels = pixels_of(image)
    return None if pixels is None else hashlib.blake2b(pixels, digest_size=16).hexdigest()


def write(folder, trees):
    """Write the unsaved images of the nodes of trees into a folder, for `restore` in another process."""
    images = {one.node.image for tree in trees for one in nodes_of(tree) if hasattr(one.node, "image")}
    found = {image.name: pixels_of(image) for image in images if image is not None and image.library is None}
    found = {name: pixels for name, pixels in found.items() if pixels is not None}
    if found:
        arrays = {str(index): pixels for index, pixels in enumerate(found.values())}
        np.savez(folder / _FILE, names=np.array(list(found)), **arrays)


def restore(folder):
    """Give the images of the open file the pixels that `write` has written into a folder, if there are any."""
    path = folder / _FILE
    if not path.is_file():
        return
    with np.load(path) as found:
        for index, name in enumerate(found["names"].tolist()):
            image, pixels = bpy.data.images.get(name), found[str(index)]
            if image is None:
                continue
            if tuple(image.size) != pixels.shape[1::-1]:
                image.scale(*pixels.shape[1::-1])
            image.pixels.foreach_set(pixels.ravel())
            image.pack()  # Cycles reads the file of an image that is not packed
