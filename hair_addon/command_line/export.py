# SPDX-License-Identifier: GPL-3.0-or-later
"""export: hair of a .blend → a file for engines and other programs."""

import time

from ..core import lazy
from ..core.errors import HairError
from ..core.files.export_settings import ENDINGS, ExportSettings
from ..core.long_work import run_now
from ..core.params import declared
from . import opening, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "export",
        help="export hair to an engine or another program",
        description="Write the hair of a .blend file and its guides: .abc as Unreal imports grooms, in centimeters "
        "with Z up, USD for Unreal, Houdini and Omniverse, or strands for other programs.",
    )
    parser.add_argument("input", help=".blend file")
    parser.add_argument("--out", required=True, metavar="FILE", help=f"file to write: {', '.join(ENDINGS)}")
    parser.add_argument("--hair", action="append", metavar="NAME", help="hair to export; may be repeated [all]")
    options.add_settings(parser, declared(ExportSettings))
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file and export its hair."""
    settings = options.changed(ExportSettings(), given, declared(ExportSettings))
    blender.io.mesh_files.require_blend(given.input)
    blender.io.groom_export.require_writable(given.out)
    opening.open_file(given, console)
    chosen = chosen_hair(given)
    started = time.perf_counter()
    scene = blender.host.scene_time.present_scene()
    made = run_now(blender.io.groom_export.exporting(given.out, chosen, settings, scene), console.progress)
    for note in made.notes:
        console.warn(str(note))
    seconds = time.perf_counter() - started
    counts = {"groups": made.groups, "guides": made.guides, "strands": made.strands, "frames": made.frames}
    values = {"verb": "export", "input": str(given.input), "out": str(made.path), **counts}
    values |= {"bytes": made.byte_count, "seconds": round(seconds, 3), "notes": [str(note) for note in made.notes]}
    console.result(values, f"{made.guides} guides, {made.strands} strands in {seconds:.2f} s: {made.path}")


def chosen_hair(given):
    """Hair Curves to export. Raises `HairError` if no hair has the given name."""
    every = blender.io.groom_sources.all_hair()
    if not given.hair:
        return every
    named = {blender.host.notices.name_of(hair): hair for hair in every}
    for name in given.hair:
        if name not in named:
            raise HairError(f'{given.input} has no hair "{name}".')
    return [named[name] for name in dict.fromkeys(given.hair)]
