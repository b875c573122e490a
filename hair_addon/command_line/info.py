# SPDX-License-Identifier: GPL-3.0-or-later
"""info: what hair, settings or tables a file holds."""

import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..core import exr, settings_file
from ..core.errors import HairError
from ..core.shading import table_axes
from . import opening, options


def add(verbs):
    """The verb's options."""
    parser = verbs.add_parser("info", help="tell what hair, settings or tables a file holds")
    parser.add_argument("input", type=Path, help=".blend, a mesh, .npz, groom settings (.json) or a table (.exr)")
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Read and tell."""
    describe = {".npz": _arrays, ".json": _settings, ".exr": _tables}.get(given.input.suffix.lower())
    if describe is None:
        from ..blender import inspection

        opening.open_file(given, console)
        values = inspection.open_file()
    else:
        values = describe(given.input)
    values = {"verb": "info", "input": str(given.input), **values}
    console.result(values, "\n".join(_in_lines({name: value for name, value in values.items() if name != "verb"})))


def _settings(path):
    return {"settings": settings_file.sections_of(settings_file.read(path))}


def _tables(path):
    """The whole set is read that a table belongs to, and found to be whole."""
    if path.stem in table_axes.DUAL_TABLES:
        return {"tables": "dual scattering", "settings": asdict(exr.read_dual_tables(path.parent).settings)}
    return {"tables": "Marschner", "settings": asdict(exr.read_tables(path.parent).settings)}


def _arrays(path):
    """Shapes and types, of which the headers tell."""
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
    """{name: value}, nested or not, as lines for people."""
    for name, value in values.items():
        rows = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for row in rows:
            if isinstance(row, dict):
                yield f"{indent}{name}:"
                yield from _in_lines(row, indent + "  ")
            else:
                yield f"{indent}{name}: {'none' if row in (None, [], '') else row}"
