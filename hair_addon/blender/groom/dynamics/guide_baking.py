# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking: simulate guides frame by frame into files for playback and rendering.

Baking resumes from the last written state and gives identical bits.
"""

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bpy.types import Curves, Scene

from ....core.errors import HairError
from ....core.files import array_file, frame_cache, frame_manifest
from ....core.files.frame_cache import FrameCache
from ....core.files.frame_manifest import Manifest
from ....core.grooming import cost
from ....core.long_work import Stage, Work
from ...data import scene as scenes
from ...data import surface_space
from ...data.simulation import varied_dynamics, wet_guides
from ...data.surfaces import cage_of
from ...host import memory, scene_time
from ...host.datablocks import Remembered
from ...host.notices import name_of
from ...settings import properties
from .. import disabled_hair, followed_names
from ..guides import guide_regions
from . import bake_resuming, broken_guides, frame_folders, guide_simulation
from .bake_resuming import Task
from .broken_guides import Broken

SOLVER_VERSION = 3  # increased when the same inputs give other frames
STATE_FRAMES = 24  # between states
_PARTING = "parting"  # a part of `key_of`
_BEYOND = 1  # extra frames after the last, for motion blur

_baking = False


def is_baking() -> bool:
    """Whether a bake is running, so that frame changes are not the artist's."""
    return _baking


@dataclass(frozen=True)
class Baked:
    """Result of a bake: the number of simulated frames, and how often strands broke and were reset to the groom.

    worst: of all existing frames, the one in which most broke; status: a sentence about a missing source of a map.
    """

    first: int
    last: int
    simulated: int
    broken: int
    worst: Broken
    status: str


@dataclass(frozen=True)
class BakedFrame:
    """A simulated and written frame: its guides, number of substeps and number of broken strands.

    seconds: time for reading, simulating and writing these guides, including their share of the scene's frame change.
    """

    guides: str
    frame: int
    seconds: float
    substeps: int
    broken: int
    folder: Path


def memory_of(guides_list: Sequence[Curves]) -> int:
    """Memory used while baking guides [bytes]."""
    counts = [(guides.vellus.dynamics.vertex_count, len(guides.curves)) for guides in guides_list]
    return sum(cost.simulation_bytes(*count) for count in counts)


def key_of(guides: Curves, scene: Scene) -> dict[str, str]:
    """Return {part: digest} of the inputs of the frames of guides, except all animation. Raises `HairError`.

    Masks are read from the dependency graph as it is, as updates call this.
    """
    settings = guide_simulation.simulated(properties.dynamics_of(guides.vellus))
    parts = {
        "solver": SOLVER_VERSION,
        "settings": guide_simulation.unkeyed(guides, settings),
        "guides": guide_simulation.combed_points(guides),
        "surface": cage_of(guides.vellus.topology),
        "frame rate": scene_time.animation_rate(scene),
        "units": scene.unit_settings.scale_length,
    }
    regions, wetness = _regions(guides), wet_guides.unkeyed(guides, scenes.last_depsgraph())
    found = {_PARTING: regions, "wet places": wetness}
    found |= {f"map of {name}": part for name, part in _varied(guides).factors.items()}
    return frame_manifest.digests_of(parts | {name: part for name, part in found.items() if part is not None})


def changed_parts(guides: Curves, scene: Scene, manifest: Manifest) -> list[str]:
    """Return the parts of `key_of` that have changed since frames were baked. Raises `HairError`.

    A part line that does not follow a deformed surface divides guides differently in each frame. This is not a change
    while hair keeps its parting, as guides are baked with the regions of their first frame.
    """
    now, baked = key_of(guides, scene), manifest.keys[-1]
    # Applied transforms change local coordinates but not the guides' positions in the world: this is not a change.
    as_before = {part: surface_space.known_as(guides, digest) for part, digest in now.items()}
    changed = sorted(part for part in {*now, *baked} if baked.get(part) not in {now.get(part), as_before.get(part)})
    if _PARTING in changed and manifest.parted_by == _parted_by(guides) and not isinstance(_regions(guides), str):
        changed.remove(_PARTING)
    return changed


def _now():
    """Return the time [s]; tests replace this clock."""
    return time.perf_counter()


def _parted_by(guides):
    return frame_manifest.digest(guide_regions.parting_keys(guides))


def _varied(guides):
    return varied_dynamics.present(guides, scenes.last_depsgraph())


def _regions(guides):
    """Return the regions of guides, None for one, or the text of the error, so that baked frames still play."""
    if not guide_regions.is_parted(guides):
        return None
    try:
        return guide_regions.regions_of(guides, scenes.last_depsgraph())
    except HairError as error:
        return str(error)


def baking(
    guides_list: Sequence[Curves],
    last: int,
    scene: Scene,
    starts_over: bool = False,
    tell: Callable[[BakedFrame], None] = lambda _frame: None,
) -> Work[list[Baked]]:
    """Bake guides up to a frame, as work in steps: one computation per frame.

    The scene returns to its frame on every exit. starts_over: simulate existing frames again; tell: called for each
    written frame of each guides datablock. Raises `HairError`.
    """
    global _baking
    memory.require(memory_of(guides_list))
    followed_names.follow()
    present, its_scene = scene_time.frame_of(scene), Remembered(scene)
    _baking = True
    with contextlib.ExitStack() as stack:
        stack.callback(_end, its_scene, present, [Remembered(guides) for guides in guides_list])
        stack.enter_context(disabled_hair.disabled_in_viewports(guides_list, scene))
        begun = [_begin(guides, last, scene) for guides in guides_list]  # a refused bake must change nothing
        tasks = [_open(*one, last, starts_over, stack) for one in begun]
        yield Stage("Baking", 0.0)
        yield from bake_resuming.resuming(tasks, its_scene)
        first = min((task.done for task in tasks), default=last)
        counts = [0] * len(tasks)
        for frame in range(first + 1, last + _BEYOND + 1):
            due = [(index, task) for index, task in enumerate(tasks) if task.done == frame - 1]
            scene = its_scene.find()  # undo replaces it
            started = _now()
            scene_time.go_to(scene, frame)
            depsgraph = scenes.present_depsgraph()
            share = (_now() - started) / max(len(due), 1)
            for _, task in due:
                task.seconds = share
            inputs = [_read(task, scene, depsgraph) for _, task in due]
            part = (frame - first) / (last + _BEYOND - first)
            yield _computing([task for _, task in due], inputs, frame, part, frame == last + _BEYOND)
            for index, task in due:
                task.done = frame
                counts[index] += 1
                _note_broken(task, frame)
                tell(_baked_frame(task, frame))
        for task in tasks:
            task.writer.complete()
    return [Baked(task.simulated.settings.start_frame, last, *result) for task, result in _results(tasks, counts)]


def _baked_frame(task, frame):
    simulation = task.simulated.simulation
    broken, folder = len(simulation.broken), task.writer.folder
    return BakedFrame(task.name, frame, task.seconds, simulation.substeps, broken, folder)


def _note_broken(task, frame):
    """Store the frame in which most guides broke in the manifest, for panels in later sessions."""
    count = len(task.simulated.simulation.broken)
    if count > task.worst.count:
        task.worst = Broken(count, frame)
        task.writer.change(notes=task.worst.notes)


def _results(tasks, counts):
    return [
        (task, (count, task.broken, task.worst, task.simulated.varied.status))
        for task, count in zip(tasks, counts, strict=True)
    ]


def _end(its_scene, present, baked):
    """Go back to the scene's former frame; its baked guides are shown after the next update."""
    global _baking
    try:
        with contextlib.suppress(HairError):  # the scene was deleted in the meantime
            scene_time.go_to(its_scene.find(), present)
    finally:
        _baking = False
    for remembered in baked:
        with contextlib.suppress(HairError):  # deleted by a script in the meantime
            frame_folders.have_changed(remembered.find())


def _begin(guides, last, scene):
    """Return guides, `GuideSimulation`, `Manifest` of the frames, digest of the animation and points.

    All are of the first frame, which is not simulated.
    """
    start = properties.dynamics_of(guides.vellus).start_frame
    if last < start:
        raise HairError(
            "The simulation begins in frame {start}, after the last frame to bake, {last}.", start=start, last=last
        )
    scene_time.go_to(scene, start)
    simulated = guide_simulation.begin(guides, scene, scenes.present_depsgraph())
    rate = scene_time.animation_rate(scene)
    layout = array_file.layout_of(simulated.simulation.save())
    combed = guide_simulation.combed_points(guides)
    guide_count, point_count = combed.shape[:2]
    keys = (key_of(guides, scene),)
    parted_by = _parted_by(guides)
    space = tuple(surface_space.applied(guides).matrix.ravel().tolist())
    spaces = () if space == frame_manifest.UNMOVED else (space,)
    details = {"parted_by": parted_by, "spaces": spaces}
    manifest = Manifest(keys, guide_count, point_count, start, last, rate, "baking", layout, **details)
    digest = bake_resuming.digest_of(guides, scene, properties.dynamics_of(guides.vellus))
    return Remembered(guides), simulated, manifest, digest, combed


def _open(named, simulated, manifest, digest, combed, last, starts_over, stack):
    """Claim the folder of guides and return their `Task` in its first frame."""
    guides, start = named.find(), manifest.first
    folder = frame_folders.new_folder(guides)
    frame_folders.forget(guides)
    if starts_over and (folder / frame_manifest.NAME).exists():
        frame_cache.remove(folder)
    before = FrameCache(folder).manifest if (folder / frame_manifest.NAME).exists() else None
    worst = broken_guides.noted(before if before is not None and before.key == manifest.key else None)
    writer = stack.enter_context(frame_cache.baking(folder, replace(manifest, notes=worst.notes)))
    there = FrameCache(folder)
    numbers = {number for number in there.state_numbers() if start < number <= last + _BEYOND}
    found = there.read_frame(start)
    if found is None or (found.key, found.digest) != (manifest.key, digest):
        numbers = set()
        writer.write_frame(start, combed, digest)
    return Task(name_of(guides), named, simulated, writer, start, there, worst=worst, numbers=numbers)


def _read(task, scene, depsgraph):
    """Return (`FrameInput`, digest of the animation) of a task in the frame of a depsgraph."""
    guides, started = task.guides.find(), _now()
    settings = guide_simulation.simulated(properties.dynamics_of(guides.vellus))
    read = guide_simulation.read(guides, scene, depsgraph, settings, task.simulated.masks)
    found = read, bake_resuming.digest_of(guides, scene, settings)
    task.seconds += _now() - started
    return found


def _computing(tasks, inputs, frame, part, is_last):
    """Return a function of (progress) that simulates and writes a frame of guides."""

    def compute(progress):
        progress(f"Frame {frame}", part)
        for task, (read, digest) in zip(tasks, inputs, strict=True):
            started = _now()
            points = task.simulated.advance(read)
            task.broken += len(task.simulated.simulation.broken)
            task.writer.write_frame(frame, points, digest)
            if is_last or (frame - task.simulated.settings.start_frame) % STATE_FRAMES == 0:
                task.writer.write_state(frame, task.simulated.simulation.save())
            task.seconds += _now() - started

    return compute
