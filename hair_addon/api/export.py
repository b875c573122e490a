# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: export."""

import os
from collections.abc import Iterable
from typing import Any

from ..core.errors import HairError
from ..core.files.export_settings import ExportSettings
from ..core.long_work import Progress, no_progress, run_now
from .arguments import changed, checked_progress, path_of
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
    """Write hair and its guides for engines and other programs; returns warnings about their import.

    path: .abc for Unreal's groom importer, .usd, .usdc and .usda for Unreal, Houdini and Omniverse, or .hair, .data,
    .ply and .npz for other programs; hair: hair Curves, which become groups of the file, None for all; settings:
    `ExportSettings`; changes: its fields by name. Warnings concern, for example, strands of zero length and missing UV
    coordinates.

    >>> api.export_groom("hair.abc", [bpy.data.objects["Hair"]], has_color=False)
    []
    """
    wanted, target = changed(ExportSettings, settings, changes), path_of(path)
    if hair is None:
        chosen = blender.io.groom_sources.all_hair()
    else:
        chosen = list(dict.fromkeys(blender.data.arguments.curves_of(one, "HAIR") for one in _listed(hair)))
    work = blender.io.groom_export.exporting(target, chosen, wanted, blender.host.scene_time.present_scene())
    return [str(note) for note in run_now(work, checked_progress(progress)).notes]


def _listed(hair):
    try:
        if not isinstance(hair, str):
            return [*hair]
    except TypeError:  # also for 0-D arrays, which have `__iter__`
        pass
    raise HairError("hair must be a list of hair Curves, or None for all.")
