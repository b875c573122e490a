# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: lookup tables."""

import os
from pathlib import Path
from typing import Any

from ..core.files.settings_file import GroomSettings
from ..core.long_work import Progress, no_progress, run_now
from ..core.params import Param, plain_value, require_class
from ..core.shading import appearance
from ..core.shading.tables import lookup_tables
from .arguments import changed, checked_progress, path_of
from .blender_access import blender

_ANY = Param("")


def table_settings(settings: GroomSettings, **changes: Any) -> lookup_tables.Settings:
    """Return the `lookup_tables.Settings` for hair with given `GroomSettings`.

    >>> settings = api.GroomSettings(appearance=api.Appearance(roughness=0.2))
    >>> api.table_settings(settings, size=64).roughness
    0.2
    """
    require_class(settings, GroomSettings, "settings")
    found = appearance.table_settings(settings.appearance, settings.tables)
    return changed(lookup_tables.Settings, found, changes)


def bake_tables(
    folder: str | os.PathLike,
    settings: lookup_tables.Settings | None = None,
    *,
    has_plots: bool = False,
    progress: Progress = no_progress,
    **changes: Any,
) -> list[Path]:
    """Bake the tables of the Marschner model and of dual scattering to OpenEXR files in a folder; returns their paths.

    settings: `lookup_tables.Settings`; has_plots: also write a plot of each table.

    >>> [path.name for path in api.bake_tables("tables", size=32)][:3]
    ['m.exr', 'n.exr', 'n_trt.exr']
    """

    settings = changed(lookup_tables.Settings, settings, changes)
    has_plots = plain_value("has_plots", has_plots, False, _ANY)
    return run_now(
        blender.io.table_files.baking_tables(settings, path_of(folder), has_plots), checked_progress(progress)
    )
