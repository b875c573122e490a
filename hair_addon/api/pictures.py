# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: pictures."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..core import imaging
from ..core.long_work import Progress, no_progress, run_now
from ..core.params import Param, plain_value
from .arguments import changed, checked_progress, choice, path_of
from .blender_access import blender

__all__ = ["draw", "render"]
_IS_ALLOWED = Param("")
_FRAMES = Param("")  # availability in this Blender is checked later


def draw(*, progress: Progress = no_progress, **settings: Any) -> np.ndarray:
    """Draw the scene's hair and meshes from its camera; returns (height, width, 4) float32.

    The picture is scene-linear and premultiplied, bottom row first; settings: fields of `PictureSettings` (width,
    height, samples_per_side, is_transparent). Samples are filtered with the scene's Filter Size, as in renders.

    >>> api.draw(width=64, height=48).shape
    (48, 64, 4)
    """
    sampling = imaging.pixel_sampling
    wanted = changed(sampling.PictureSettings, None, settings, sampling.FRAME_FIELDS)
    return run_now(blender.render.offscreen.drawing_picture(wanted), checked_progress(progress))


def render(
    path: str | os.PathLike,
    *,
    frame: int | None = None,
    engine: str = "vellus",
    allow_missing: bool = False,
    progress: Progress = no_progress,
    **settings: Any,
) -> Path:
    """Render a frame of the scene, the current one for None, and write it atomically as .png or .exr.

    engine: "vellus", "cycles" or "eevee"; settings: fields of `PictureSettings` (width, height, sample_count,
    is_transparent, has_passes), width and height default to the scene's; allow_missing: render despite missing linked
    libraries, images or caches, which are errors otherwise. Returns the path, in which ### is replaced with the frame
    number. Views of a stereoscopic scene are saved according to its output settings: in one file, or in a file for each
    view, with its suffix before the extension.

    >>> api.render("frame_####.png", frame=3, width=64, height=48).name
    'frame_0003.png'
    """

    path, engine, progress = (
        path_of(path),
        choice(engine, "engine", blender.io.pictures.frames.ENGINES),
        checked_progress(progress),
    )
    sampling, settings = imaging.pixel_sampling, blender.io.pictures.frames.scene_size() | settings
    wanted = changed(sampling.PictureSettings, None, settings, sampling.DRAWING_FIELDS)
    frame = plain_value("frame", blender.host.scene_time.present_frame() if frame is None else frame, 1, _FRAMES)
    blender.io.pictures.frames.require_pattern(path, 1)
    target = blender.io.pictures.frames.path_of(path, frame)
    allows_missing = plain_value("allow_missing", allow_missing, False, _IS_ALLOWED)
    blender.io.pictures.frames.write_frame(target, frame, engine, wanted, None, progress, allows_missing)
    return target
