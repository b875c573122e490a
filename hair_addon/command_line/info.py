# SPDX-License-Identifier: GPL-3.0-or-later
"""info: show the hair, settings or tables in a file, or list looks and style presets."""

import math
from dataclasses import asdict

from ..core import lazy
from ..core.errors import HairError
from ..core.files import settings_file, table_exr, untrusted_arrays
from ..core.shading.tables import table_axes
from . import opening, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "info",
        help="show the hair, settings or tables in a file, or list looks and style presets",
        description="Show the hair, settings or tables in a file. Without a file, list the looks and style presets.",
    )
    parser.add_argument(
        "input", nargs="?", help=".blend, a mesh, .npz, a file of strands, groom settings (.json) or a table (.exr)"
    )
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Read the file and print its summary."""
    if given.input is None:
        blender.require_registered()
        saved = blender.settings
        values = {"looks": saved.saved_looks.all_names(), "style_presets": saved.saved_styles.all_names()}
        console.result({"verb": "info", **values}, "\n".join(_in_lines(values)))
        return
    describe = {".npz": _arrays, ".json": _settings, ".exr": _tables}.get(given.input.suffix.lower())
    if given.input.suffix.lower() in blender.io.curve_files.OF_STRANDS:
        values = {"curves": blender.io.curve_files.summary(given.input)}
    elif describe is None:
        opening.open_file(given, console, has_curves=True)
        values = blender.io.inspection.open_file()
        if given.input.suffix.lower() in blender.io.curve_files.OF_OTHERS:
            values["curves"] = blender.io.curve_files.summary(given.input)
    else:
        values = describe(given.input)
    values = {"verb": "info", "input": str(given.input), **values}
    console.result(values, "\n".join(_in_lines({name: value for name, value in values.items() if name != "verb"})))


def _settings(path):
    settings = settings_file.read(path)
    return {"settings": settings_file.sections_of(settings) | {"styles": settings_file.list_of_styles(settings)}}


def _tables(path):
    """Read the complete set that a table belongs to, which validates it."""
    if path.stem in table_axes.DUAL_TABLES:
        return {"tables": "dual scattering", "settings": asdict(table_exr.read_dual_tables(path.parent).settings)}
    return {"tables": "Marschner", "settings": asdict(table_exr.read_tables(path.parent).settings)}


def _arrays(path):
    """Return shapes and types from the headers."""
    if path.exists() and not path.is_file():  # opening a pipe without a writer would block
        raise HairError(f"{path} cannot be read: it is not a file.")
    with untrusted_arrays.opened(path) as archive:
        return {"arrays": {name: _array(archive, name) for name in untrusted_arrays.names(archive)}}


def _array(archive, name):
    shape, kind = untrusted_arrays.header(archive, name)
    return {"shape": list(shape), "type": str(kind), "bytes": math.prod(shape) * kind.itemsize}


def _in_lines(values, indent=""):
    """Format {name: value}, nested or not, as lines of text."""
    for name, value in values.items():
        rows = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for row in rows:
            if isinstance(row, dict):
                yield f"{indent}{name}:"
                yield from _in_lines(row, indent + "  ")
            else:
                yield f"{indent}{name}: {'none' if row in (None, [], '') else row}"
