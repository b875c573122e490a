# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of a frame: one, or one per view of a stereoscopic scene, named with the view's suffix."""

from pathlib import Path

import bpy

from ....core.errors import HairError

_OF_STEREO = {"left", "right"}  # names of the views that Blender renders for stereo


def files_of(path):
    """Return the paths of a frame's files, one per view; path: without view suffix. Raises `HairError`."""
    path = Path(path)
    return [path.with_name(f"{path.stem}{suffix}{path.suffix}") for suffix in _suffixes(path)]


def views_format(path, has_passes):
    """Return Blender's views format for the open scene: the one set, if the file format supports it.

    A file with passes as layers stores both views of a stereo picture as parts.
    """
    if _are_apart(path):
        return "INDIVIDUAL"
    return "MULTIVIEW" if has_passes else bpy.context.scene.render.image_settings.views_format


def _suffixes(path):
    views = _views()
    if not views or not _are_apart(path):
        return [""]
    suffixes = [view.file_suffix for view in views]
    if len({*suffixes}) < len(suffixes) or any(letter in suffix for suffix in suffixes for letter in "/\\"):
        raise HairError("The scene's views need file suffixes that differ and have no slash: change Stereoscopy.")
    return suffixes


def _are_apart(path):
    chosen = bpy.context.scene.render.image_settings.views_format
    is_one_file = chosen == "STEREO_3D" or (chosen == "MULTIVIEW" and Path(path).suffix.lower() == ".exr")
    return len(_views()) < 2 or not is_one_file


def _views():
    """Return the rendered views of the open scene; none without Stereoscopy."""
    render = bpy.context.scene.render
    if not render.use_multiview:
        return []
    is_stereo = render.views_format == "STEREO_3D"
    return [view for view in render.views if view.use and (view.name in _OF_STEREO or not is_stereo)]
