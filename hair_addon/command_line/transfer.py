# SPDX-License-Identifier: GPL-3.0-or-later
"""transfer: hair of a .blend → another mesh in that file."""

import time

from ..core import lazy
from ..core.errors import HairError
from ..core.grooming.transfer_settings import TransferSettings
from ..core.long_work import run_now
from ..core.params import declared
from . import opening, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "transfer",
        help="copy hair to another mesh",
        description="Copy a hair system of a .blend file to another mesh in it, of any topology: guides, settings, "
        "styles and look.",
    )
    parser.add_argument("input", help=".blend file")
    parser.add_argument("--to", required=True, metavar="NAME", help="mesh object to copy the hair to")
    parser.add_argument("--out", required=True, help=".blend, .usd*, .abc, or .npz with the arrays of the copy")
    parser.add_argument("--hair", default="", metavar="NAME", help="hair to copy; needed if the file has several")
    options.add_settings(parser, declared(TransferSettings))
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file, transfer the hair and write the result."""
    settings = options.changed(TransferSettings(), given, declared(TransferSettings))
    blender.io.mesh_files.require_blend(given.input)
    blender.io.groom_files.require_writable(given.out)
    file_axes = opening.open_file(given, console)
    hair, target = _hair(given), blender.io.mesh_files.find_surface(given.to)
    started = time.perf_counter()
    guides, _settings = blender.groom.pipeline.inputs_of(hair)
    depsgraph = blender.data.scene.present_depsgraph()
    work = blender.groom.transfer.system_transfer.transferring(guides, hair, target, settings, depsgraph)
    made = run_now(work, console.progress)
    for sentence, values in made.notes():
        console.warn(sentence.format(**values))
    seconds = time.perf_counter() - started
    console.progress("Writing", 1.0)
    blender.io.groom_files.write(given.out, made.guides, made.hair, file_axes)
    counts = {"guides": len(made.guides.curves), "lost": made.places.lost_count, "strands": len(made.hair.curves)}
    values = {"verb": "transfer", "input": str(given.input), "surface": target.name, "out": str(given.out), **counts}
    values |= {"scale": made.places.scale, "seconds": round(seconds, 3)}
    sentence = f"{counts['guides']} guides, {counts['strands']} strands on {target.name}"
    console.result(values, f"{sentence} in {seconds:.2f} s: {given.out}")


def _hair(given):
    """Return the hair Curves to copy. Raises `HairError`."""
    every = blender.io.groom_sources.all_hair()
    named = {blender.host.notices.name_of(hair): hair for hair in every}
    if given.hair and given.hair not in named:
        raise HairError(f'{given.input} has no hair "{given.hair}".')
    if given.hair:
        return named[given.hair]
    if len(every) != 1:
        raise HairError(f"{given.input} has {len(every)} hair systems: name one with --hair.")
    return every[0]
