# SPDX-License-Identifier: GPL-3.0-or-later
"""Input, output and report shared by the commands that convert hair to meshes."""

import time

from ..core import lazy
from . import export, opening, options

blender = lazy.Package("..blender", __package__)

_ENDINGS = ".blend, .glb, .vrm, .fbx, .usdc, .obj"


def add(parser):
    """Add the options of input and output."""
    parser.add_argument("input", help=".blend file")
    parser.add_argument("--out", required=True, metavar="FILE", help=f"file to write: {_ENDINGS}")
    parser.add_argument("--hair", action="append", metavar="NAME", help="hair to convert; may be repeated [all]")
    options.add_scripts(parser)


def make(given, console, made_of):
    """Open the input, make meshes of each hair and write them.

    made_of(hair): returns ([object], {name: count}, notes).
    """
    blender.io.mesh_files.require_blend(given.input)
    blender.io.mesh_export.require_writable(given.out)
    opening.open_file(given, console)
    started, objects, summaries = time.perf_counter(), [], []
    for hair in export.chosen_hair(given):
        made, counts, notes = made_of(hair)
        for note in notes:
            console.warn(str(note))
        objects += made
        summaries.append({"hair": blender.host.notices.name_of(hair), **counts})
    blender.io.mesh_export.write(given.out, objects)
    seconds = time.perf_counter() - started
    values = {"verb": given.run.__module__.rpartition(".")[2], "input": str(given.input), "out": str(given.out)}
    sentence = "".join(f"{line}\n" for summary in summaries for line in _errors(summary))
    sentence += f"{len(objects)} meshes in {seconds:.2f} s: {given.out}"
    console.result(
        values | {"made": summaries, "bytes": given.out.stat().st_size, "seconds": round(seconds, 3)}, sentence
    )


def _errors(summary):
    """Return a line for each level of cards whose error was measured."""
    return [
        f"{summary['hair']}, level {index}: errors: coverage {error['coverage']:.3f}, FLIP {error['flip']:.3f}"
        for index, error in enumerate(summary.get("errors", ()))
    ]
