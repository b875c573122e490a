# SPDX-License-Identifier: GPL-3.0-or-later
"""render: a .blend → pictures of its frames, which a run that was stopped leaves for the next to go on with."""

import time
from pathlib import Path

from ..core.params import declared
from ..core.picture import FrameSettings
from . import helpers, opening, options

_ENGINES = ("vellus", "cycles", "eevee")
_SETTINGS = {"width", "height"}  # the scene's, unless they are given


def add(verbs):
    """The verb's options."""
    parser = verbs.add_parser(
        "render",
        help="render frames of a .blend file",
        description="Render frames of a .blend file. Frames that are there already are left as they are: the same "
        "command goes on where another left off, and several at once, on any machines, share the frames.",
    )
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
    parser.add_argument("--samples", type=int, metavar="N", help="of each pixel [the scene's]")
    parser.add_argument("--transparent", action="store_true", help="leave the background empty")
    parser.add_argument("--passes", action="store_true", help="all passes, as layers of the .exr")
    parser.add_argument("--overwrite", action="store_true", help="make frames again that are there already")
    parser.add_argument(
        "--jobs", type=options.count, default=1, metavar="N", help="processes that share the frames on this machine [1]"
    )
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open, and make one frame after the other; or let several processes do so."""
    from ..blender import frames, mesh_files

    mesh_files.require_blend(given.input)
    frames.require_pattern(given.out, len(given.frames) if isinstance(given.frames, range) else 1)
    opening.open_file(given, console)
    numbers = frames.scene_frames() if given.frames == "all" else given.frames
    numbers = list(numbers or [frames.present_frame()])
    frames.require_pattern(given.out, len(numbers))
    settings = _frame_settings(given, frames.scene_size())
    if frames.is_sequence(given.out):
        _make_sequence(given, console, numbers, settings)
    else:
        started = time.perf_counter()
        frames.write_frame(given.out, numbers[0], given.engine, settings, progress=console.progress)
        _tell(given, console, numbers[0], given.out, started)


def _make_sequence(given, console, numbers, settings):
    from ..blender import cli_command, files, frames, sequence

    values = {name: getattr(settings, name) for name, _default, _details in declared(FrameSettings)}
    described = sequence.description(given.input, given.engine, values | {"scripts": given.enable_scripts})
    sequence.begin(given.out, numbers, described, given.overwrite)
    if given.jobs > 1:
        words = [*cli_command.words(), *_words(given, numbers, settings)]
        helpers.run([words] * given.jobs, console, _sentence)
        return

    def write(path, number):
        frames.write_frame(path, number, given.engine, settings, files.partial_of(path), console.progress)

    started = time.perf_counter()
    for number, path in sequence.make(given.out, numbers, write, console.progress):
        _tell(given, console, number, path, started)
        started = time.perf_counter()


def _words(given, numbers, settings):
    """The command of one of several processes."""
    words = ["render", str(given.input), "--out", str(given.out), "--frames", f"{numbers[0]}-{numbers[-1]}", "--json"]
    words += ["--engine", given.engine, "--width", str(settings.width), "--height", str(settings.height)]
    words += ["--samples", str(settings.sample_count)] if settings.sample_count else []
    flags = {"transparent": given.transparent, "passes": given.passes, "enable-scripts": given.enable_scripts}
    return words + [f"--{name}" for name, is_given in flags.items() if is_given]


def _tell(given, console, frame, path, started):
    seconds = time.perf_counter() - started
    values = {"verb": "render", "input": str(given.input), "frame": frame, "engine": given.engine}
    values |= {"out": str(path), "seconds": round(seconds, 3)}
    console.result(values, _sentence(values))


def _sentence(values):
    return f"Frame {values['frame']} in {values['seconds']:.2f} s: {values['out']}"


def _frame_settings(given, size):
    """`FrameSettings` of what was asked for. Raises `HairError`."""
    asked = size | {name: getattr(given, name) for name in _SETTINGS if getattr(given, name) is not None}
    if given.samples is not None:
        asked["sample_count"] = given.samples
    return FrameSettings(**asked, is_transparent=given.transparent, has_passes=given.passes)
