# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of the open scene → picture files, each of them whole: rendered by Vellus, Cycles or EEVEE."""

import contextlib
from pathlib import Path

import bpy

from ..core.errors import HairError
from ..core.long_work import unheard
from ..core.params import declared
from ..core.picture import PassSettings
from . import engine as render_engine
from . import files, viewport

# As a user names them → as Blender does.
ENGINES = {"vellus": viewport.ENGINE, "cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}

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


def is_sequence(pattern):
    """Whether a pattern names a file for each frame."""
    return _number_width(Path(pattern)) > 0


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


def write_frame(path, frame, engine, settings, partial=None, progress=unheard):
    """Render a frame of the open scene and write it; the file appears whole or not at all. Raises `HairError`.

    engine: of `ENGINES`; settings: `FrameSettings`; partial: of `files.whole_file`; progress(step, part): told how far
    it is, and may raise to stop it: Vellus after any pass, others before the file is written.
    """
    blender_scene = bpy.context.scene
    if settings.has_passes and path.suffix.lower() != ".exr":
        raise HairError(f"Passes are layers of an .exr, which {path} is not: name it so.")
    if blender_scene.camera is None:
        raise HairError("The scene has no camera to look through: add one.")
    with files.whole_file(path, partial) as partial, _rendering(blender_scene, partial, engine, settings):
        blender_scene.frame_set(frame)
        progress(f"Frame {frame}", 0.0)
        try:
            with render_engine.listening(lambda _step, part: progress(f"Frame {frame}", part)):
                ended = bpy.ops.render.render(write_still=True, scene=blender_scene.name)
        except RuntimeError as error:
            raise HairError(f"Frame {frame} was not rendered: {files.cause_of(error)}.") from error
        if ended != {"FINISHED"}:
            raise HairError(f"Frame {frame} was not rendered: {engine} stopped before its end.")
        progress(f"Frame {frame}", 1.0)


@contextlib.contextmanager
def _rendering(blender_scene, path, engine, settings):
    """The scene's own settings of renders are others for the time that it takes."""
    wanted = [*_of_scene(blender_scene, path, engine, settings)]
    if settings.has_passes:
        wanted += [change for layer in blender_scene.view_layers for change in _of_layer(layer)]
    before = [(owner, name, getattr(owner, name)) for owner, name, _value in wanted]
    try:
        _set(wanted)
        yield
    finally:
        _set(before)


def _of_scene(blender_scene, path, engine, settings):
    render, image = blender_scene.render, blender_scene.render.image_settings
    file_format, color_depth = _FORMATS[path.suffix.lower()]
    yield render, "engine", ENGINES[engine]
    yield render, "filepath", str(path.absolute())
    yield render, "use_file_extension", False
    yield render, "resolution_x", settings.width
    yield render, "resolution_y", settings.height
    yield render, "resolution_percentage", 100
    yield render, "film_transparent", settings.is_transparent or render.film_transparent
    yield image, "media_type", "MULTI_LAYER_IMAGE" if settings.has_passes else "IMAGE"
    yield image, "file_format", "OPEN_EXR_MULTILAYER" if settings.has_passes else file_format
    if not settings.has_passes:
        yield image, "color_mode", "RGBA"
    yield image, "color_depth", color_depth
    if settings.sample_count:
        owner, name = {
            "vellus": (blender_scene.vellus, "sample_count"),
            "cycles": (blender_scene.cycles, "samples"),
            "eevee": (blender_scene.eevee, "taa_render_samples"),
        }[engine]
        yield owner, name, settings.sample_count


def _of_layer(view_layer):
    for name in ("use_pass_z", "use_pass_vector", "use_pass_shadow"):
        yield view_layer, name, True
    for name, _default, _details in declared(PassSettings):
        yield view_layer.vellus, name, True


def _set(values):
    for owner, name, value in values:
        setattr(owner, name, value)
