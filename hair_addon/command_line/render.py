# SPDX-License-Identifier: GPL-3.0-or-later
"""render: a .blend → pictures of its frames."""

import time
from pathlib import Path

from .. import api
from ..core.long_work import part_of
from . import opening, options

_ENGINES = ("vellus", "cycles", "eevee")


def add(verbs):
    """The verb's options."""
    parser = verbs.add_parser("render", help="draw the hair of a .blend file from its camera")
    parser.add_argument("input", type=Path, help=".blend file")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="PATTERN", help=".png or .exr; a row of # becomes the frame's number"
    )
    parser.add_argument(
        "--frames",
        type=options.frame_range,
        metavar="A-B",
        help="frames from A to B, one frame, or all of the scene's [the one it was saved in]",
    )
    parser.add_argument("--engine", choices=_ENGINES, default="vellus", help="who makes the picture [vellus]")
    parser.add_argument("--width", type=int, metavar="N", help="pixels [the scene's]")
    parser.add_argument("--height", type=int, metavar="N", help="pixels [the scene's]")
    parser.add_argument("--samples-per-side", type=int, metavar="N", help="of Vellus: 4 gives 16 samples a pixel [4]")
    parser.add_argument("--transparent", action="store_true", help="leave the background empty")
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open, and make one frame after the other."""
    from ..blender import frames, mesh_files

    mesh_files.require_blend(given.input)
    frame_count = len(given.frames) if isinstance(given.frames, range) else 1
    frames.require_pattern(given.out, frame_count)
    opening.open_file(given, console)
    settings = _picture_settings(given)
    wanted = given.frames or [frames.present_frame()]
    if given.frames == "all":
        wanted = frames.scene_frames()
        frames.require_pattern(given.out, len(wanted))
    for number, frame in enumerate(wanted):
        progress = part_of(console.progress, number / len(wanted), (number + 1) / len(wanted))
        progress(f"Frame {frame}", 0.0)
        started = time.perf_counter()
        path = api.render(given.out, frame=frame, engine=given.engine, progress=progress, **settings)
        seconds = time.perf_counter() - started
        values = {"verb": "render", "input": str(given.input), "frame": frame, "engine": given.engine}
        values |= {"out": str(path), "seconds": round(seconds, 3)}
        console.result(values, f"Frame {frame} in {seconds:.2f} s: {path}")


def _picture_settings(given):
    """{name: value} of what was asked for; api.render takes the rest from the scene."""
    asked = {name: getattr(given, name) for name in ("width", "height", "samples_per_side")}
    asked["is_transparent"] = given.transparent
    return {name: value for name, value in asked.items() if value is not None}
