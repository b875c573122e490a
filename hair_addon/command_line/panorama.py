# SPDX-License-Identifier: GPL-3.0-or-later
"""The panorama of a world, rendered by Cycles.

blender/data/pictures/world_panoramas.py runs this command in a process of its own. It is for internal use and not
listed.
"""

from ..core import lazy

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser("panorama")
    parser.add_argument("input", help="a .blend with one world")
    parser.add_argument("--out", required=True, help="the .exr")
    parser.add_argument("--frame", type=float, default=1.0)
    parser.set_defaults(run=run, json=True, quiet=False, verbose=False)


def run(given, console):
    """Render a panorama of a file's world."""
    blender.io.pictures.world_panorama.render(given.input, given.frame, given.out)
    console.result({"panorama": given.out}, "")
