# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures by Cycles for views and renders: panoramas of worlds and lights, and materials of meshes.

blender/data/pictures runs these commands in another process. They are for internal use and are not listed.
"""

import json

from ..core import lazy

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the options of the commands."""
    panorama = verbs.add_parser("panorama")
    panorama.add_argument("input", help="a .blend with the world or light")
    panorama.add_argument("--out", required=True, help="the .exr, or the .npz of a light")
    panorama.add_argument("--frame", type=float, default=1.0)
    panorama.add_argument("--name", required=True, help="of the world or light")
    panorama.add_argument("--matrix", help="rows of the light's matrix, a JSON list; none for a world")
    panorama.set_defaults(run=run, json=True, quiet=False, verbose=False)
    bake = verbs.add_parser("bake_surfaces")
    bake.add_argument("input", help="a .blend with the meshes")
    bake.add_argument("--sources", required=True, help="(file of the library, name) of the objects, a JSON list")
    bake.add_argument("--frame", type=float, default=1.0)
    bake.add_argument("--out", required=True, help="the folder of 0.npz, 1.npz, …")
    bake.add_argument("--for-render", action="store_true", help="use the modifiers of renders")
    bake.set_defaults(run=bake_surfaces, json=True, quiet=False, verbose=False)


def run(given, console):
    """Render a panorama of a file's world, or of one of its lights."""
    pictures = blender.io.pictures
    if given.matrix is None:
        pictures.world_panorama.render(given.input, given.name, given.frame, given.out)
    else:
        matrix = json.loads(given.matrix)
        pictures.light_panorama.render(given.input, given.name, matrix, given.frame, given.out)
    console.result({"panorama": given.out}, "")


def bake_surfaces(given, console):
    """Bake the materials of objects of a file and its libraries."""
    sources = json.loads(given.sources)
    blender.io.pictures.surface_bake.bake(given.input, sources, given.frame, given.for_render, given.out)
    console.result({"baked": len(sources)}, "")
