# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of the open scene → picture files, each of them whole: drawn by Vellus, or rendered by Cycles or EEVEE."""

import contextlib
from pathlib import Path

import bpy

from ..core.errors import HairError
from ..core.long_work import run_now, unheard
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


def write_frame(path, frame, engine, settings, progress=unheard):
    """Make a frame of the open scene and write it; the file appears whole or not at all. Raises `HairError`.

    engine: of `ENGINES`; settings: `render.PictureSettings`, of which other engines than ours take size and background;
    progress(step, part): told how far ours is.
    """
    blender_scene = bpy.context.scene
    blender_scene.frame_set(frame)
    with _set_for_a_while(_image_settings(blender_scene, Path(path).suffix.lower())):
        if engine == "vellus":
            pixels = run_now(render.drawing_picture(settings), progress)
            with files.whole_file(path) as partial:
                render.write_picture(pixels, partial, blender_scene)
            return
        with _set_for_a_while(_render_settings(blender_scene, ENGINES[engine], settings)):
            _render(blender_scene, frame, engine)
            with files.whole_file(path) as partial:
                bpy.data.images["Render Result"].save_render(str(partial), scene=blender_scene)


def _render(blender_scene, frame, engine):
    """Have Blender render what the scene's settings say. Raises `HairError`."""
    if blender_scene.camera is None:
        raise HairError("The scene has no camera to look through: add one.")
    try:
        outcome = bpy.ops.render.render(scene=blender_scene.name)
    except RuntimeError as error:
        raise HairError(f"{engine} could not make frame {frame}: {files.cause_of(error)}.") from error
    if outcome != {"FINISHED"}:
        raise HairError(f"{engine} stopped before frame {frame} was done.")


def _image_settings(blender_scene, ending):
    """[(owner, name, value)] of what Blender writes a picture by; a scene may be set to write a film."""
    file_format, color_depth = _FORMATS[ending]
    image = blender_scene.render.image_settings
    values = {"media_type": "IMAGE", "file_format": file_format, "color_mode": "RGBA", "color_depth": color_depth}
    return [(image, name, value) for name, value in values.items()]


def _render_settings(blender_scene, engine, settings):
    """[(owner, name, value)] of what Blender renders a picture by."""
    owner = blender_scene.render
    return [
        (owner, "engine", engine),
        (owner, "resolution_x", settings.width),
        (owner, "resolution_y", settings.height),
        (owner, "resolution_percentage", 100),
        (owner, "film_transparent", settings.is_transparent or owner.film_transparent),
    ]


@contextlib.contextmanager
def _set_for_a_while(wanted):
    """Set [(owner, name, value)], and in the end what was there before."""
    before = [(owner, name, getattr(owner, name)) for owner, name, _value in wanted]
    try:
        _set(wanted)
        yield
    finally:
        _set(before)


def _set(values):
    for owner, name, value in values:
        setattr(owner, name, value)
