# SPDX-License-Identifier: GPL-3.0-or-later
"""bake-tables: Marschner settings → tables as OpenEXR."""

import time

from .. import api
from ..core.files import settings_file
from ..core.params import declared
from ..core.shading.tables import lookup_tables
from . import options


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("bake-tables", help="bake the Marschner model's tables to OpenEXR")
    parser.add_argument("--out", required=True, help="folder for the tables: m.exr, n.exr, n_trt.exr, …")
    parser.add_argument("--plot", action="store_true", help="also write a picture of each table, with labeled axes")
    options.add_settings_file(parser)
    options.add_settings(parser, declared(lookup_tables.Settings))
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Bake the tables and write them."""
    settings = lookup_tables.Settings()
    if given.settings:
        settings = api.table_settings(settings_file.read(given.settings))
    settings = options.changed(settings, given, declared(lookup_tables.Settings))
    started = time.perf_counter()
    paths = api.bake_tables(given.out, settings, has_plots=given.plot, progress=console.progress)
    seconds = time.perf_counter() - started
    files = [str(path) for path in paths]
    values = {"verb": "bake-tables", "out": str(given.out), "files": files, "seconds": round(seconds, 3)}
    console.result(values, f"{len(files)} files in {seconds:.2f} s: {given.out}")
