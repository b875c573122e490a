# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files whose importers end Blender where a file is damaged: they are read by a process of its own.

`import`, the command of that process, makes a .blend of the file. It is for commands that read meshes, not for people,
and not listed.
"""

import tempfile
from pathlib import Path

import numpy as np

from ..core import lazy
from ..core.errors import HairError
from . import helpers

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("import")
    parser.add_argument("input")
    parser.add_argument("--out", required=True)
    parser.add_argument("--up", choices=("Y", "Z"), default="Z")
    parser.set_defaults(run=run, json=True, quiet=False, verbose=False)


def run(given, console):
    """Import, evaluate, write."""
    blender.host.memory.limit_this_process()  # a damaged file may ask for any amount
    file_axes = blender.io.mesh_files.open_file(given.input, up=given.up)
    blender.io.mesh_files.save_scene(given.out)
    console.result({"file_axes": file_axes.tolist()}, "")


def open_apart(path, up, console):
    """`mesh_files.open_file` by a process of its own. Raises `HairError`, also where that process is ended."""
    heard = []
    with tempfile.TemporaryDirectory(prefix="vellus_", ignore_cleanup_errors=True) as folder:
        made = Path(folder) / "made.blend"
        words = [*blender.host.cli_command.words(), "import", str(path.absolute()), f"--out={made}", "--up", up]
        for failed in helpers.run([words], console, heard.append, "Reading"):
            raise HairError(
                failed.complaint
                or f"{path} cannot be read: Blender's importer ended without a word ({failed.cause}), "
                "as it does where a file is damaged."
            )
        blender.io.mesh_files.load_scene(made)
    return np.array(heard[-1]["file_axes"])
