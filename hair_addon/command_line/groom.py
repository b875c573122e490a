# SPDX-License-Identifier: GPL-3.0-or-later
"""groom: a mesh → guides and hair."""

import time
from dataclasses import replace
from pathlib import Path

from .. import api
from ..core.shading.presets import PRESETS
from . import opening, options


def add(verbs):
    """The verb's options."""
    parser = verbs.add_parser("groom", help="grow guides and hair on a mesh")
    parser.add_argument("input", type=Path, help="file with the mesh: .blend .obj .ply .stl .glb .gltf .usd* .abc")
    parser.add_argument("--out", type=Path, required=True, help=".blend, .usd*, .abc, or .npz with the arrays")
    parser.add_argument("--surface", default="", metavar="NAME", help="the mesh object; not needed where there is one")
    parser.add_argument("--up", choices=("Y", "Z"), default="Z", help="axis that points up in an .obj, .ply, .stl [Z]")
    parser.add_argument("--preset", choices=PRESETS, metavar="NAME", help=f"a look: {', '.join(PRESETS)}")
    options.add_scripts(parser)
    options.add_groom_settings(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Read, grow, write."""
    settings = options.groom_settings(given)
    if given.preset:
        look = replace(PRESETS[given.preset][1], mode=settings.appearance.mode)
        settings = options.changed_groom(replace(settings, appearance=look), given)
    from ..blender import groom_files, mesh_files

    mesh_files.require_readable(given.input)
    groom_files.require_writable(given.out)
    file_axes = opening.open_file(given, console)
    surface = mesh_files.find_surface(given.surface)
    started = time.perf_counter()
    guides, hair = api.add_hair(surface, settings, progress=console.progress)
    seconds = time.perf_counter() - started
    console.progress("Writing", 1.0)
    groom_files.write(given.out, guides, hair, file_axes)
    counts = {"guides": len(guides.curves), "strands": len(hair.curves)}
    values = {"verb": "groom", "input": str(given.input), "surface": surface.name, "out": str(given.out), **counts}
    values |= {"points": len(hair.points), "seconds": round(seconds, 3), "bytes": given.out.stat().st_size}
    made = f"{counts['guides']} guides, {counts['strands']} strands on {surface.name}"
    console.result(values, f"{made} in {seconds:.2f} s: {given.out}")
