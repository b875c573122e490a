# SPDX-License-Identifier: GPL-3.0-or-later
"""settings: groom settings as a file to begin with, or what editors check such a file by."""

from pathlib import Path

from ..core import settings_file
from . import options


def add(verbs):
    """The verb's options."""
    parser = verbs.add_parser("settings", help="write groom settings: the defaults, with what options change")
    parser.add_argument("--out", type=Path, metavar="FILE", help=".json; without it they are printed")
    parser.add_argument("--schema", action="store_true", help="the JSON Schema of such files instead")
    options.add_groom_settings(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Write, or print."""
    if given.schema:
        values = settings_file.schema()
    else:
        values = settings_file.to_object(options.groom_settings(given))
    if given.out is None:
        console.result(values, settings_file.text_of(values).rstrip())
        return
    settings_file.write_object(given.out, values)
    console.result({"verb": "settings", "out": str(given.out)}, f"Settings written to {given.out}")
