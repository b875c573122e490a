# SPDX-License-Identifier: GPL-3.0-or-later
"""Marschner settings → files with the tables of the model and of dual scattering."""

import imbuf

from ...core.files import table_exr
from ...core.files.atomic_file import atomic_file
from ...core.long_work import Stage
from ...core.shading.tables import dual_scattering, lookup_tables
from ..host import paths
from ..settings import preferences
from . import table_plots


def baking_tables(settings, folder, has_plots=False):
    """Bake `lookup_tables.Settings` into a folder, as work in steps; returns the paths of the files.

    has_plots: whether to write a plot of each table beside it. Raises `HairError`.
    """
    device = preferences.device()
    tables = yield lambda progress: lookup_tables.bake(settings, device, progress)
    dual = yield lambda progress: dual_scattering.bake(tables)
    yield Stage("Writing the tables", 1.0)
    written = table_exr.write_tables(folder, tables, paths.addon_version())
    written += table_exr.write_dual_tables(folder, dual, paths.addon_version())
    for name, picture in table_plots.plot_tables(tables, dual).items() if has_plots else ():
        with atomic_file(folder / f"{name}.png") as partial:
            imbuf.write(picture, filepath=str(partial))
        written.append(folder / f"{name}.png")
    return written
