# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of the open scene → image files, written atomically: rendered by Vellus, Cycles or EEVEE."""

import contextlib
import os
from pathlib import Path

import bpy

from ....core.errors import HairError, cause_of
from ....core.files.atomic_file import atomic_files, new_partial_of, require_writable_path
from ....core.imaging import picture_checks
from ....core.imaging.pixel_sampling import FIRST_FRAME, LAST_FRAME, PassSettings
from ....core.long_work import no_progress
from ....core.params import declared
from ...data import scene
from ...data.pictures import rendered_files
from ...data.strands import curves
from ...groom.dynamics import frame_folders
from ...host import scene_time
from ...live import live_hair
from ...render import data_passes
from ...render.frames import engine as render_engine
from ...render.viewport import viewport
from . import view_files

# Names in options → Blender's names.
ENGINES = {"vellus": viewport.ENGINE, "cycles": "CYCLES", "eevee": "BLENDER_EEVEE"}

# Extension → (Blender's format, bits per channel).
_FORMATS = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32")}


def scene_size():
    """Return {"width", "height"} of the open scene's renders [pixels]."""
    settings = bpy.context.scene.render
    part = settings.resolution_percentage / 100.0
    return {"width": max(1, int(settings.resolution_x * part)), "height": max(1, int(settings.resolution_y * part))}


def path_of(pattern, frame):
    """Return the file of a frame: its number, padded with zeros, replaces the last run of # in the pattern's name."""
    pattern = Path(pattern)
    width = _number_width(pattern)
    if not width:
        return pattern
    before, _hashes, after = pattern.name.rpartition("#" * width)
    return pattern.with_name(f"{before}{frame:0{width + (frame < 0)}d}{after}")


def is_sequence(pattern):
    """Whether a pattern names a file for each frame."""
    return _number_width(Path(pattern)) > 0


def require_pattern(pattern, frame_count, has_passes=False):
    """Raise `HairError` unless a number of frames, with passes or without, can be written to a pattern.

    docs/farm/vellus-render.js refuses the same patterns when a job is submitted.
    """
    pattern = Path(pattern)
    if pattern.suffix.lower() not in _FORMATS:
        ending = pattern.suffix or "a file without an extension"
        raise HairError(f"Pictures are saved as {' or '.join(_FORMATS)}, not as {ending}.")
    _require_layers(pattern, has_passes)
    if os.sep == "/" and "\\" in str(pattern.absolute()):
        raise HairError(f"{pattern} has a backslash, which Blender treats as a path separator: choose another path.")
    if frame_count > 1 and not _number_width(pattern):
        raise HairError(f"{pattern} is a single file for {frame_count} frames: add #### for the frame number.")
    try:
        str(pattern.absolute()).encode()
    except UnicodeEncodeError as error:
        raise HairError(f"{str(pattern)!a} cannot be written: Blender accepts only UTF-8 paths.") from error
    require_writable_path(path_of(pattern, 1))


def _require_layers(path, has_passes):
    if has_passes and path.suffix.lower() != ".exr":
        raise HairError(f"Passes are layers of an .exr file: change the extension of {path}.")


def require_view_layer():
    """Raise `HairError` if no view layer of the open scene is rendered: Blender would crash."""
    if not any(layer.use for layer in bpy.context.scene.view_layers):
        raise HairError("No view layer of the scene is rendered: turn on Use for Rendering in one of them.")


def require_camera(blender_scene):
    """Raise `HairError` if a scene has no camera."""
    if blender_scene.camera is None:
        raise HairError("The scene has no camera: add one.")


def bind_simulated():
    """Bind simulated hair in its start frame, so that its bits do not depend on the frame rendered first.

    Strands are bound in world axes, where a rotating surface differs by rounding in each frame.
    """
    blender_scene = scene_time.present_scene()
    for guides in frame_folders.simulating():
        scene_time.go_to(blender_scene, guides.vellus.dynamics.start_frame)
        for hair in curves.followers(guides):
            if hair.vellus.is_live and not curves.follows_library(hair):
                live_hair.regenerate(hair, scene.present_depsgraph())


def _number_width(pattern):
    """Length of the last run of # in a name."""
    name = pattern.name.rstrip("".join({*pattern.name} - {"#"}))
    return len(name) - len(name.rstrip("#"))


def missing_files(numbers, allows_missing=False):
    """Return a sentence listing the files that are missing in the given frames; "" if there are none.

    Raises `HairError` with that sentence unless `allows_missing`.
    """
    if not allows_missing:
        rendered_files.require(bpy.context.scene, numbers)
        return ""
    names = rendered_files.missing(bpy.context.scene, numbers)
    return f"rendered without missing files: {rendered_files.in_short(names)}." if names else ""


def write_frame(path, frame, engine, settings, partial=None, progress=no_progress, allows_missing=False):
    """Render a frame of the open scene and write its files atomically. Raises `HairError`.

    path: as in `view_files.files_of`; engine: a key of `ENGINES`; settings: `PictureSettings`, ignoring
    `DRAWING_FIELDS`; partial: temporary path, None for a new one; progress(step, part): may raise to stop the render,
    for Vellus after any pass, for other engines before the file is written; allows_missing: render even if files that
    the scene needs are missing.
    """
    blender_scene = bpy.context.scene
    if not FIRST_FRAME <= frame <= LAST_FRAME:
        raise HairError(f"There is no frame {frame}: Blender's frames range from {FIRST_FRAME} to {LAST_FRAME}.")
    require_view_layer()
    _require_layers(path, settings.has_passes)
    require_camera(blender_scene)
    files, partial = view_files.files_of(path), partial or new_partial_of(Path(path))
    partials = view_files.files_of(partial)
    with atomic_files(files, partials), _rendering(blender_scene, partial, engine, settings):
        missing_files([frame], allows_missing)
        frame_folders.require_readable([frame], blender_scene)
        scene_time.go_to(blender_scene, frame)
        progress(f"Frame {frame}", 0.0)
        try:
            with render_engine.listening(lambda _step, part: progress(f"Frame {frame}", part)):
                ended = bpy.ops.render.render(write_still=True, scene=blender_scene.name)
        except RuntimeError as error:
            raise HairError(f"Frame {frame} was not rendered: {cause_of(error)}.") from error
        if ended != {"FINISHED"}:
            raise HairError(f"Frame {frame} was not rendered: {engine} stopped before it finished.")
        for written, file in zip(partials, files, strict=True):
            picture_checks.require_whole(written, file)
        progress(f"Frame {frame}", 1.0)


@contextlib.contextmanager
def _rendering(blender_scene, path, engine, settings):
    """Override the scene's render settings within the context."""
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
    # Braces delimit template variables in this path; double them to escape.
    yield render, "filepath", str(path.absolute()).replace("{", "{{").replace("}", "}}")
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
    yield image, "views_format", view_files.views_format(path, settings.has_passes)
    if settings.sample_count:
        yield *_sample_property(blender_scene, engine), settings.sample_count


def scene_samples(engine):
    """Return the number of samples per pixel that the open scene sets for an engine, a key of `ENGINES`."""
    return getattr(*_sample_property(bpy.context.scene, engine))


def _sample_property(blender_scene, engine):
    return {
        "vellus": (blender_scene.vellus, "sample_count"),
        "cycles": (blender_scene.cycles, "samples"),
        "eevee": (blender_scene.eevee, "taa_render_samples"),
    }[engine]


def _of_layer(view_layer):
    for name in ("use_pass_z", *data_passes.SETTINGS, "use_pass_vector", "use_pass_shadow"):
        yield view_layer, name, True
    for name, _default, _details in declared(PassSettings):
        yield view_layer.vellus, name, True


def _set(values):
    for owner, name, value in values:
        setattr(owner, name, value)
