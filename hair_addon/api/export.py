# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions of exports."""

import os
from collections.abc import Iterable
from typing import Any

from ..core.errors import HairError
from ..core.files.export_settings import ExportSettings
from ..core.long_work import Progress, no_progress, run_now
from .arguments import changed, heard, path_of
from .blender_access import blender

Curves = Any

__all__ = ["ExportSettings", "export_groom"]


def export_groom(
    path: str | os.PathLike,
    hair: Iterable[Curves] | None = None,
    settings: ExportSettings | None = None,
    *,
    progress: Progress = no_progress,
    **changes: Any,
) -> list[str]:
    """Write hair and its guides for engines and other programs; returns what their importers will do with it.

    path: .abc is written as Unreal imports grooms, .usd, .usdc and .usda for Unreal, Houdini and Omniverse; hair: hair
    Curves, a group each in the file, None for all; settings: `ExportSettings`; changes: its fields by name. The
    sentences that come back tell of strands without length, of missing UV coordinates, and of other things to know.

    >>> api.export_groom("hair.abc", [bpy.data.objects["Hair"]], has_color=False)
    []
    """
    wanted, target = changed(ExportSettings, settings, changes), path_of(path)
    if hair is None:
        chosen = blender.io.groom_sources.all_hair()
    else:
        chosen = list(dict.fromkeys(blender.data.arguments.curves_of(one, "HAIR") for one in _listed(hair)))
    work = blender.io.groom_export.exporting(target, chosen, wanted, blender.host.scene_time.present_scene())
    return [str(note) for note in run_now(work, heard(progress)).notes]


def _listed(hair):
    try:
        if not isinstance(hair, str):
            return [*hair]
    except TypeError:  # also an array without dimensions, which has the method of iterables
        pass
    raise HairError("hair must be a list of hair Curves, or None for all.")
