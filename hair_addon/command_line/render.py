# SPDX-License-Identifier: GPL-3.0-or-later
"""render: a .blend → images of its frames; repeating the command resumes an interrupted run."""

import argparse
import time

from ..core import lazy
from ..core.errors import HairError
from ..core.files.atomic_file import partial_of
from ..core.imaging.pixel_sampling import DRAWING_FIELDS, PictureSettings
from ..core.params import declared
from . import helpers, opening, options

blender = lazy.Package("..blender", __package__)

_Flag = argparse.BooleanOptionalAction  # job templates cannot omit options
_ENGINES = ("vellus", "cycles", "eevee")
_SETTINGS = {"width", "height"}  # default to the scene's


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "render",
        help="render frames of a .blend file",
        description="Render frames of a .blend file. Existing frames are kept: running the same command "
        "again resumes where it stopped, and several processes, on any machines, share the frames.",
    )
    parser.add_argument("input", help=".blend file")
    parser.add_argument(
        "--out", required=True, metavar="PATTERN", help=".png or .exr; # characters stand for the frame number"
    )
    parser.add_argument(
        "--frames",
        type=options.frame_range,
        metavar="A-B",
        help="frames A to B, one frame, or all frames of the scene [current frame of the file]",
    )
    parser.add_argument("--engine", choices=_ENGINES, default="vellus", help="render engine [vellus]")
    parser.add_argument("--width", type=int, metavar="N", help="width in pixels [from the scene]")
    parser.add_argument("--height", type=int, metavar="N", help="height in pixels [from the scene]")
    parser.add_argument("--samples", type=int, metavar="N", help="samples per pixel [from the scene]")
    parser.add_argument("--transparent", action=_Flag, default=False, help="render a transparent background")
    parser.add_argument("--passes", action=_Flag, default=False, help="write all passes as layers of the .exr")
    parser.add_argument(
        "--allow-missing",
        action=_Flag,
        default=False,
        help="render despite missing linked libraries, images or caches, with a warning",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="check everything and print what would be rendered; creates the folder of the frames, but no file",
    )
    parser.add_argument("--overwrite", action="store_true", help="render existing frames again")
    parser.add_argument(
        "--jobs", type=options.count, default=1, metavar="N", help="number of processes on this machine [1]"
    )
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file and render its frames, in this process or in several."""
    blender.io.mesh_files.require_blend(given.input)
    known_count = len(given.frames) if isinstance(given.frames, range) else 1
    blender.io.pictures.frames.require_pattern(given.out, known_count, given.passes)
    opening.open_file(given, console)
    numbers = blender.host.scene_time.scene_frames() if given.frames == "all" else given.frames
    numbers = list(numbers or [blender.host.scene_time.present_frame()])
    blender.io.pictures.frames.require_pattern(given.out, len(numbers))
    blender.io.pictures.frames.require_view_layer()
    blender.groom.dynamics.frame_folders.require_baked(numbers, blender.host.scene_time.present_scene())
    without = blender.io.pictures.frames.missing_files(numbers, given.allow_missing)
    if without:
        console.warn(without)
    if given.engine == "vellus":
        for sentence, values in blender.data.pictures.unread_nodes.sentences(blender.host.scene_time.present_scene()):
            console.warn(sentence.format(**values))
    settings = _frame_settings(given, blender.io.pictures.frames.scene_size())
    if given.dry_run:
        _plan(given, console, numbers, settings)
        return
    blender.io.pictures.frames.bind_simulated()
    if blender.io.pictures.frames.is_sequence(given.out):
        _make_sequence(given, console, numbers, settings)
    else:
        started = time.perf_counter()
        write = blender.io.pictures.frames.write_frame
        write(given.out, numbers[0], given.engine, settings, None, console.progress, given.allow_missing)
        _report(given, console, numbers[0], given.out, started)


def _plan(given, console, numbers, settings):
    """Print what the command would render; raises `HairError` where it would fail before the first frame."""
    blender.io.pictures.frames.require_camera(blender.host.scene_time.present_scene())
    left = numbers
    if blender.io.pictures.frames.is_sequence(given.out) and not given.overwrite:
        described = _description(given, settings)
        blender.io.pictures.sequence.require_continuable(given.out, numbers, described)
        left = blender.io.pictures.sequence.unrendered_frames(given.out, numbers)
    values = {"verb": "render", "input": str(given.input), "dry_run": True, "engine": given.engine}
    values |= {"out": str(given.out), "width": settings.width, "height": settings.height}
    values |= {"samples": settings.sample_count or blender.io.pictures.frames.scene_samples(given.engine)}
    values |= {"frames": numbers, "to_render": left, "hair": blender.io.inspection.rendered_hair()}
    console.result(values, _plan_in_words(values))


def _plan_in_words(values):
    count, left = len(values["frames"]), len(values["to_render"])
    size = f"{values['width']} x {values['height']} pixels, {values['samples']} samples"
    yet = f"{left} of {count} frames" if count > 1 else f"{left} frame"
    lines = [f"Would render {yet} with {values['engine']}, {size}: {values['out']}"]
    lines += [f"{hair['name']}: {hair['strands']} strands on {hair['surface']}" for hair in values["hair"]]
    return "\n".join(lines if values["hair"] else [*lines, "No hair is rendered."])


def _description(given, settings):
    """Return what identifies the sequence that a command renders."""
    names = [name for name, _default, _details in declared(PictureSettings) if name not in DRAWING_FIELDS]
    values = {name: getattr(settings, name) for name in names}
    return blender.io.pictures.sequence.description(
        given.input, given.engine, values | {"scripts": given.enable_scripts}
    )


def _make_sequence(given, console, numbers, settings):
    blender.io.pictures.sequence.begin(given.out, numbers, _description(given, settings), given.overwrite)
    if given.jobs > 1:
        _run_jobs(given, console, numbers, settings)
        return

    def write(path, number):
        settled = settings, partial_of(path), console.progress, given.allow_missing
        blender.io.pictures.frames.write_frame(path, number, given.engine, *settled)

    started = time.perf_counter()
    for number, path in blender.io.pictures.sequence.make(given.out, numbers, write, console.progress):
        _report(given, console, number, path, started)
        started = time.perf_counter()


def _run_jobs(given, console, numbers, settings):
    """Render in several processes. If one fails, the others render its frames; only missing frames are an error."""
    words = [*blender.host.cli_command.words(), *_words(given, numbers, settings)]
    failed = helpers.run([words] * given.jobs, console, lambda values: console.result(values, _sentence(values)))
    missing = blender.io.pictures.sequence.missing_frames(given.out, numbers)
    if missing:
        raise HairError(str(failed[0]) if failed else f"Frame {missing[0]} was not rendered.")
    for one in failed:
        console.warn(f"all frames are rendered, but not by all processes: {one}")


def _words(given, numbers, settings):
    """Return the arguments of a worker process."""
    words = ["render", str(given.input.absolute()), f"--out={given.out.absolute()}", "--json"]
    words += [f"--frames={numbers[0]}-{numbers[-1]}"]
    words += ["--engine", given.engine, "--width", str(settings.width), "--height", str(settings.height)]
    words += ["--samples", str(settings.sample_count)] if settings.sample_count else []
    flags = {"transparent": given.transparent, "passes": given.passes, "enable-scripts": given.enable_scripts}
    flags |= {"allow-missing": given.allow_missing}
    return words + [f"--{name}" for name, is_given in flags.items() if is_given]


def _report(given, console, frame, path, started):
    seconds = time.perf_counter() - started
    values = {"verb": "render", "input": str(given.input), "frame": frame, "engine": given.engine}
    values |= {"out": str(path), "seconds": round(seconds, 3)}
    console.result(values, _sentence(values))


def _sentence(values):
    return f"Frame {values['frame']} in {values['seconds']:.2f} s: {values['out']}"


def _frame_settings(given, size):
    """Return the requested `PictureSettings`. Raises `HairError`."""
    asked = size | {name: getattr(given, name) for name in _SETTINGS if getattr(given, name) is not None}
    if given.samples is not None:
        asked["sample_count"] = given.samples
    return PictureSettings(**asked, is_transparent=given.transparent, has_passes=given.passes)
