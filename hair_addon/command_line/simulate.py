# SPDX-License-Identifier: GPL-3.0-or-later
"""simulate: guides of a .blend → baked frames for render; repeating the command resumes."""

from ..core import lazy
from ..core.errors import HairError
from ..core.long_work import run_now
from . import opening, options

blender = lazy.Package("..blender", __package__)


def add(verbs):
    """Add the command's options."""
    parser = verbs.add_parser(
        "simulate",
        help="simulate the guides of a .blend file",
        description="Simulate the guides of a .blend file and bake the frames into its cache folder, where render "
        "finds them. Running the same command again resumes where it stopped.",
    )
    parser.add_argument("input", help=".blend file")
    last = parser.add_mutually_exclusive_group()
    last.add_argument(
        "--frames",
        type=options.frame_range,
        metavar="A-B",
        help="frames A to B, one frame, or all frames of the scene: they are simulated from the guides' start frame "
        "to B [all]",
    )
    last.add_argument("--last-frame", type=int, metavar="N", help="the same as --frames N")
    parser.add_argument(
        "--guides", action="append", metavar="NAME", help="guides to simulate; may be repeated [all with Dynamics on]"
    )
    parser.add_argument(
        "--deliver",
        metavar="FILE",
        help="also write a .blend whose hair plays the frames without Vellus, and the played files beside it",
    )
    parser.add_argument(
        "--if-needed",
        action="store_true",
        help="simulate only guides whose baked frames are rendered; do nothing if there are none",
    )
    parser.add_argument("--overwrite", action="store_true", help="simulate existing frames again")
    options.add_scripts(parser)
    options.add_common(parser)
    parser.set_defaults(run=run)


def run(given, console):
    """Open the file and bake its guides."""
    blender.io.mesh_files.require_blend(given.input)
    if given.deliver is not None:
        _require_delivery(given)
    opening.open_file(given, console)
    scene_last = blender.host.scene_time.scene_frames()[-1]
    last = _last_frame(given, scene_last)
    if given.deliver is not None and last < scene_last:
        option = "--last-frame" if given.last_frame is not None else "--frames"
        raise HairError(f"--deliver needs all frames of the scene, to {scene_last}: leave out {option}.")
    folders = blender.groom.dynamics.frame_folders
    guides = [_named(name) for name in given.guides] if given.guides else folders.simulating()
    if given.if_needed:
        guides = [one for one in folders.rendered(last) if one in guides]
        if not guides and given.deliver is None:
            return
    if not guides:
        raise HairError(f"{given.input} has no guides with Dynamics on: turn it on, or name guides with --guides.")
    _warn_of_memory(guides, console)

    def report(baked):
        values = {"verb": "simulate", "input": str(given.input), "guides": baked.guides, "frame": baked.frame}
        values |= {"seconds": round(baked.seconds, 3), "substeps": baked.substeps, "broken": baked.broken}
        values |= {"out": str(baked.folder)}
        console.result(values, f"{baked.guides}: frame {baked.frame} in {baked.seconds:.2f} s")

    scene = blender.host.scene_time.present_scene()
    baking = blender.groom.dynamics.guide_baking.baking(guides, last, scene, given.overwrite, report)
    for one, made in zip(guides, run_now(baking, console.progress), strict=True):
        if made.worst.count:
            console.warn(str(made.worst.message_of(one)))
        if made.status:
            console.warn(made.status)
    if given.deliver is not None:
        _deliver(given, guides, scene, console)


def _last_frame(given, scene_last):
    if given.frames is not None:
        return scene_last if given.frames == "all" else given.frames[-1]
    return scene_last if given.last_frame is None else given.last_frame


def _require_delivery(given):
    """Raise `HairError` unless a delivered .blend could be written."""
    if given.deliver.suffix.lower() != ".blend":
        raise HairError(f"--deliver writes a .blend file, not {given.deliver}.")
    if given.deliver.resolve() == given.input.resolve():
        raise HairError("--deliver would replace the file that is simulated: choose another name.")
    blender.io.groom_files.require_writable(given.deliver)


def _deliver(given, guides_list, scene, console):
    for guides in guides_list:
        guides.vellus.simulates = True
        path = blender.io.delivery.path_of(guides, given.deliver.absolute())
        made = run_now(blender.io.delivery.delivering(guides, path, scene), console.progress)
        name = blender.host.notices.name_of(guides)
        values = {"verb": "simulate", "input": str(given.input), "guides": name, "delivered": str(path)}
        values |= {"first": made.first, "last": made.last, "strands": made.strand_count, "bytes": made.byte_count}
        console.result(values, f"{name}: frames {made.first} to {made.last} delivered in {path}")
    blender.io.groom_files.save_copy(given.deliver)


def _warn_of_memory(guides, console):
    part = blender.host.memory.share_of_free(blender.groom.dynamics.guide_baking.memory_of(guides))
    if part > blender.host.memory.MUCH:
        console.warn(f"Simulating takes {round(100.0 * part)} % of the free memory.")


def _named(name):
    """Guide Curves with a name, or with an object of that name. Raises `HairError`."""
    found = blender.groom.selection.guides_named(name)
    if found is None:
        raise HairError(f'There are no guides "{name}" in the file.')
    return found
