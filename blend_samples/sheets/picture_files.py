# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as arrays: drawn, read from files, laid side by side with words, and written as small files.

All are (H, W, 3) uint8 as displayed, the top row first.
"""

import tempfile
from pathlib import Path

import blf
import bpy
import imbuf
import numpy as np

from hair_addon import api

BACKGROUND = 24  # of sheets
CAPTION = 24  # pixels: the height of a line of words
BASELINE = 17  # pixels of a caption's words from its top
PAGE_BITS = 0xFC  # of a color that is kept in the pictures of the documentation
FEW_BITS = 0xF8  # the same of small pictures

# Settings of files, as small as they get without a difference to the eye.
_FORMATS = {
    ".png": {"file_format": "PNG", "color_depth": "8", "compression": 100},
    ".jpg": {"file_format": "JPEG", "quality": 85},
}


def read(path):
    """Return a picture of a file."""
    image = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty((image.size[1], image.size[0], image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    bpy.data.images.remove(image)
    return np.round(255.0 * pixels[::-1, :, :3]).astype(np.uint8)


def drawn(width, height, **settings):
    """Return the scene through its camera; settings: of `api.render`."""
    return _written(lambda path: api.render(path, width=width, height=height, **settings))


def drawn_at_once(width, height, samples_per_side):
    """Return the same by the operator *Render Picture*."""
    size = {"width": width, "height": height, "samples_per_side": samples_per_side}
    return _written(lambda path: bpy.ops.vellus.render_picture(filepath=str(path), **size))


def rendered(scene=None):
    """Return the scene, the context's by default, by its engine in its size."""
    scene = scene or bpy.context.scene

    def render(path):
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)

    return _written(render)


def _written(write):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        write(path)
        return read(path)


def below_caption(picture, height=CAPTION):
    """Return a picture with room for words above it."""
    return np.concatenate([np.full((height, picture.shape[1], 3), BACKGROUND, np.uint8), picture])


def rows(pictures, columns):
    """One picture of several of the same size, row after row; a last row that is not full is left out."""
    lines = [pictures[first : first + columns] for first in range(0, len(pictures), columns)]
    return np.concatenate([np.concatenate(line, axis=1) for line in lines if len(line) == len(lines[0])])


def scaled(picture, width):
    """Return a picture at another width [pixels] with the same proportions."""
    height = round(picture.shape[0] * width / picture.shape[1])
    image = bpy.data.images.new("Scaled", picture.shape[1], picture.shape[0])
    opaque = np.dstack([picture / np.float32(255.0), np.ones(picture.shape[:2], np.float32)])
    image.pixels.foreach_set(opaque[::-1].ravel())
    image.scale(width, height)
    pixels = np.array(image.pixels, np.float32).reshape(height, width, 4)
    bpy.data.images.remove(image)
    return np.round(255.0 * pixels[::-1, :, :3]).astype(np.uint8)


def write(pixels, path, words=(), kept_bits=0xFF):
    """Write a picture with words [(text, left, base from the top)] as .png or .jpg.

    kept_bits: of each color, fewer for smaller PNGs.
    """
    picture = imbuf.new(pixels.shape[1::-1])
    opaque = np.full(pixels.shape[:2], 255, np.uint8)
    with picture.with_buffer(write=True) as buffer:
        np.asarray(buffer)[...] = np.dstack([pixels & kept_bits, opaque])[::-1]
    blf.size(0, 14)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    with blf.bind_imbuf(0, picture):
        for text, left, base in words:
            blf.position(0, left, pixels.shape[0] - base, 0.0)
            blf.draw_buffer(0, text)
    imbuf.write(picture, filepath=str(path))
    _compress(path)
    print(path, flush=True)


def _compress(path):
    """Write a picture again, small, in the format of its name."""
    settings, view = bpy.context.scene.render.image_settings, bpy.context.scene.view_settings
    # The color mode comes last: which there are depends on the format.
    wanted = {"media_type": "IMAGE"} | _FORMATS[path.suffix] | {"color_mode": "RGB"}
    before = {name: getattr(settings, name) for name in wanted}
    shown = view.view_transform, view.look
    image = bpy.data.images.load(str(path), check_existing=False)
    try:
        view.view_transform, view.look = "Standard", "None"
        for name, value in wanted.items():
            setattr(settings, name, value)
        image.save_render(str(path))
    finally:
        for name, value in before.items():
            setattr(settings, name, value)
        view.view_transform, view.look = shown
        bpy.data.images.remove(image)
