# SPDX-License-Identifier: GPL-3.0-or-later
"""tubes: hair of a .blend → a mesh of tubes."""

from ..core import lazy
from ..core.cards.card_settings import TubeSettings
from ..core.long_work import run_now
from ..core.params import declared
from . import mesh_output, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "tubes",
        help="make a mesh of strands",
        description="Make a mesh in which each strand is a closed tube.",
    )
    mesh_output.add(parser)
    options.add_settings(parser, declared(TubeSettings))
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file, make the tubes and write them."""
    settings = options.changed(TubeSettings(), given, declared(TubeSettings))
    mesh_output.make(given, console, lambda hair: _tubes(console, hair, settings))


def _tubes(console, hair, settings):
    made = run_now(blender.io.hair_meshes.making_tubes(hair, settings), console.progress)
    return [made.mesh_object], {"tubes": made.tube_count, "triangles": made.triangle_count}, made.notes
