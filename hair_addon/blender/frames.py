# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of the open scene → picture files, each of them whole: drawn by Vellus, or rendered by Cycles or EEVEE."""

import contextlib
from pathlib import Path

import bpy

from ..core.errors import HairError
from . import files, render

# As a user names them → Blender's name of the engine; we draw ourselves.
ENGINES = {"vellus": "", "cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}

# Ending → (Blender's format, bits of a colour).
_FORMATS = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32")}


def scene_size():
    """{"width", "height"} of the open scene's pictures [pixels]."""
    settings = bpy.context.scene.render
    part = settings.resolution_percentage / 100.0
    return {"width": max(1, int(settings.resolution_x * part)), "height": max(1, int(settings.resolution_y * part))}


def scene_frames():
    """The range of the open scene's frames."""
    return range(bpy.context.scene.frame_start, bpy.context.scene.frame_end + 1)


def present_frame():
    """The number of the frame that the open scene is in."""
    return bpy.context.scene.frame_current


def path_of(pattern, frame):
    """The file of a frame: the last row of # in a pattern's name becomes the number, padded with zeros."""
    pattern = Path(pattern)
    width = _number_width(pattern)
    if not width:
        return pattern
    before, _hashes, after = pattern.name.rpartition("#" * width)
    return pattern.with_name(f"{before}{frame:0{width + (frame < 0)}d}{after}")


def require_pattern(pattern, frame_count):
    """Raise `HairError` unless so many frames can be written by a pattern."""
    pattern = Path(pattern)
    if pattern.suffix.lower() not in _FORMATS:
        ending = pattern.suffix or "a file without an ending"
        raise HairError(f"A picture is written as {' or '.join(_FORMATS)}, not as {ending}.")
    if frame_count > 1 and not _number_width(pattern):
        raise HairError(f"{pattern} names one file for {frame_count} frames: put #### where their number is to stand.")
    files.require_writable(path_of(pattern, 1))


def _number_width(pattern):
    """How many # stand in the last row of them in a name."""
    name = pattern.name.rstrip("".join({*pattern.name} - {"#"}))
    return len(name) - len(name.rstrip("#"))


def write_frame(path, frame, engine, settings):
    """Make a frame of the open scene and write it; the file appears whole or not at all. Raises `HairError`.

    engine: of `ENGINES`; settings: `render.PictureSettings`, of which other engines than ours take size and background.
    """
    blender_scene = bpy.context.scene
    blender_scene.frame_set(frame)
    if engine == "vellus":
        pixels = render.draw_picture(settings)
        with files.whole_file(path) as partial:
            render.write_picture(pixels, partial, blender_scene)
    else:
        with files.whole_file(path) as partial, _rendering(blender_scene, partial, ENGINES[engine], settings):
            if bpy.ops.render.render(write_still=True, scene=blender_scene.name) != {"FINISHED"}:
                raise HairError(f"Frame {frame} was not rendered: {engine} stopped before its end.")


@contextlib.contextmanager
def _rendering(blender_scene, path, engine, settings):
    """The scene's own settings of renders are others for the time that it takes."""
    file_format, color_depth = _FORMATS[path.suffix.lower()]
    owner, image = blender_scene.render, blender_scene.render.image_settings
    wanted = [
        (owner, "engine", engine),
        (owner, "filepath", str(path)),
        (owner, "use_file_extension", False),
        (owner, "resolution_x", settings.width),
        (owner, "resolution_y", settings.height),
        (owner, "resolution_percentage", 100),
        (owner, "film_transparent", settings.is_transparent or owner.film_transparent),
        (image, "media_type", "IMAGE"),
        (image, "file_format", file_format),
        (image, "color_mode", "RGBA"),
        (image, "color_depth", color_depth),
    ]
    before = [(owner, name, getattr(owner, name)) for owner, name, _value in wanted]
    try:
        _set(wanted)
        yield
    finally:
        _set(before)


def _set(values):
    for owner, name, value in values:
        setattr(owner, name, value)
