# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading of files in a separate process: native importers can crash or hang on damaged files.

The process runs the command `import`, which converts a mesh file to a .blend, or tries to read its curves. The command
is for internal use and not listed.
"""

import tempfile
from pathlib import Path

import numpy as np

from ..core import lazy
from ..core.errors import HairError
from . import helpers

blender = lazy.Package("..blender", __package__)

# Time limit per file [s] and per byte of it [s]: several times what the slowest importer takes on a slow machine.
_PATIENCE, _PATIENCE_A_BYTE = 120.0, 5e-6


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("import")
    parser.add_argument("input")
    parser.add_argument("--out", help="the .blend")
    parser.add_argument("--curves", action="store_true", help="read all curves")
    parser.add_argument("--up", choices=("Y", "Z"), default="Z")
    parser.set_defaults(run=run, json=True, quiet=False, verbose=False)


def run(given, console):
    """Import, evaluate and write the mesh; read all curves."""
    blender.host.memory.limit_this_process()  # a damaged file may request any amount of memory
    file_axes = None
    if given.out is not None:
        file_axes = blender.io.mesh_files.open_file(given.input, up=given.up).tolist()
        blender.io.mesh_files.save_scene(given.out)
    if given.curves and blender.io.curve_files.is_read_natively(given.input):
        blender.io.curve_files.read_all(given.input)
    console.result({"file_axes": file_axes}, "")


def open_apart(path, up, console, has_curves=False):
    """Run `mesh_files.open_file` in a separate process. Raises `HairError`, also if that process crashes.

    has_curves: whether this process will read curves of the file; the separate process tries them first.
    """
    received = []
    with tempfile.TemporaryDirectory(prefix="vellus_", ignore_cleanup_errors=True) as folder:
        made = Path(folder) / "made.blend"
        options = [f"--out={made}", "--up", up, *(["--curves"] if has_curves else [])]
        _run(path, options, console, received.append)
        blender.io.mesh_files.load_scene(made)
    return np.array(received[-1]["file_axes"])


def try_curves(path, console):
    """Raise `HairError` if a separate process that reads the curves of a file crashes or reports an error."""
    if blender.io.curve_files.is_read_natively(path):
        _run(path, ["--curves"], console, lambda _values: None)


def _run(path, options, console, receive):
    words = [*blender.host.cli_command.words(), "import", str(path.absolute()), *options]
    seconds = _PATIENCE + _PATIENCE_A_BYTE * path.stat().st_size
    for failed in helpers.run([words], console, receive, "Reading", seconds):
        if failed.is_late:
            raise HairError(f"{path} cannot be read: reading takes too long, so the file may be damaged.")
        raise HairError(
            failed.complaint
            or f"{path} cannot be read: its importer crashed ({failed.cause}), so the file may be damaged."
        )
