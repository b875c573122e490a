# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews in menus: image files for built-in looks and style presets, color swatches for saved looks.

Blender loads and keeps them as previews; nothing is loaded before the menu is drawn.
"""

from pathlib import Path

import bpy
import bpy.utils.previews
import numpy as np
from mathutils import Color

from ...core.errors import HairError
from ...core.files import style_presets
from ...core.shading import appearance
from ..settings import saved_looks

# Drawn by blend_samples/pictures/look_pictures.py.
FOLDER = Path(__file__).parent / "look_pictures"

_SWATCH_SIZE = 32  # pixels

_previews = None


def picture(identifier):
    """Icon of a built-in look."""
    key = f"preset {identifier}"
    previews = _collection()
    if key not in previews:
        previews.load(key, str(FOLDER / f"{identifier}.png"), "IMAGE")
    return previews[key].icon_id


def style_picture(identifier):
    """Icon of a style preset, None if there is no picture beside its file."""
    path = style_presets.FOLDER / f"{identifier.lower()}.png"
    key = f"style {identifier}"
    previews = _collection()
    if key not in previews:
        if not path.is_file():
            return None
        previews.load(key, str(path), "IMAGE")
    return previews[key].icon_id


def swatch(name):
    """Icon with the mean color of a saved look, 0 if its file cannot be read; a file is read once after each save."""
    key = f"saved {name} {saved_looks.change_time(name)}"
    previews = _collection()
    if key not in previews:
        try:
            color = appearance.mean_color(saved_looks.read(name))
        except HairError:
            return 0
        _fill(previews.new(key), color)
    return previews[key].icon_id


def present_swatch(look):
    """Icon of the mean color of an `Appearance`."""
    color = appearance.mean_color(look)
    shown = bytes(np.rint(255.0 * np.array(Color(color).from_scene_linear_to_srgb()).clip(0.0, 1.0)).astype(np.uint8))
    key = f"color {shown.hex()}"  # dragging sliders needs a few hundred at most
    previews = _collection()
    if key not in previews:
        _fill(previews.new(key), color)
    return previews[key].icon_id


def _fill(preview, color):
    pixels = np.ones((_SWATCH_SIZE, _SWATCH_SIZE, 4), np.float32)
    pixels[..., :3] = Color(color).from_scene_linear_to_srgb()
    preview.icon_size = preview.image_size = (_SWATCH_SIZE, _SWATCH_SIZE)
    preview.icon_pixels_float = preview.image_pixels_float = pixels.ravel().tolist()


def _collection():
    global _previews
    if _previews is None:
        _previews = bpy.utils.previews.new()
    return _previews


def unregister():
    """Free all previews."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
