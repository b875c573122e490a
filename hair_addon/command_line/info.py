# SPDX-License-Identifier: GPL-3.0-or-later
"""info: show the hair, settings or tables in a file."""

import zipfile
from dataclasses import asdict

import numpy as np

from ..core import lazy
from ..core.errors import HairError
from ..core.files import settings_file, table_exr
from ..core.shading.tables import table_axes
from . import opening, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("info", help="show the hair, settings or tables in a file")
    parser.add_argument("input", help=".blend, a mesh, .npz, groom settings (.json) or a table (.exr)")
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Read and print."""
    describe = {".npz": _arrays, ".json": _settings, ".exr": _tables}.get(given.input.suffix.lower())
    if describe is None:
        opening.open_file(given, console)
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
    try:
        with zipfile.ZipFile(path) as archive:
            return {"arrays": {name.removesuffix(".npy"): _array(archive, name) for name in archive.namelist()}}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise HairError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.") from error


def _array(archive, name):
    with archive.open(name) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _is_fortran, kind = read(file)
    return {"shape": list(shape), "type": str(kind), "bytes": int(np.prod(shape, dtype=np.int64)) * kind.itemsize}


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
