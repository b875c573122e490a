# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking: guides simulated frame by frame into files, which playing and rendering then read.

Baking goes on where it was stopped, from the last state that was written, and comes to the same bits.
"""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bpy.types import Curves, Scene

from ...core.errors import HairError
from ...core.files import array_file, frame_cache, frame_manifest
from ...core.files.frame_cache import FrameCache, Writer
from ...core.files.frame_manifest import Manifest
from ...core.long_work import Stage, Work
from ...core.params import given
from ..data import scene as scenes
from ..host import scene_time
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..settings import properties
from . import frame_folders, guide_simulation
from .guide_simulation import FrameInput, GuideSimulation

SOLVER_VERSION = 1  # of all that frames follow from beside settings: raised when they come out otherwise
STATE_FRAMES = 24  # between states
_BEYOND = 1  # frames after the last one, for motion blur

_baking = False


def is_baking() -> bool:
    """Whether guides are being baked: then a change of frame is none of the artist's."""
    return _baking


@dataclass(frozen=True)
class Baked:
    """What was baked: frames simulated now, and how often strands broke and were put back to their groom."""

    first: int
    last: int
    simulated: int
    broken: int


@dataclass(frozen=True)
class BakedFrame:
    """A frame that was simulated and written: of which guides, in how many substeps, how many strands broke."""

    guides: str
    frame: int
    substeps: int
    broken: int
    folder: Path


@dataclass
class _Task:
    """Guides that are being baked."""

    name: str
    guides: Remembered
    simulated: GuideSimulation
    writer: Writer
    done: int  # the last frame that is there
    broken: int = 0


def key_of(guides: Curves, scene: Scene) -> dict[str, str]:
    """{part: digest} of what the frames of some guides follow from, but for the animation, of settings too.

    Raises `HairError`.
    """
    settings = given(properties.dynamics_of(guides.vellus))
    keyed = properties.keyed_dynamics_of(guides.vellus)
    return frame_manifest.digests_of(
        {
            "solver": SOLVER_VERSION,
            "settings": {name: value for name, value in settings.items() if name not in keyed},
            "guides": guide_simulation.combed_points(guides),
            "surface": guides.vellus.topology,
            "frame rate": scene.render.fps / scene.render.fps_base,
            "units": scene.unit_settings.scale_length,
        }
    )


def baking(
    guides_list: Sequence[Curves],
    last: int,
    scene: Scene,
    starts_over: bool = False,
    tell: Callable[[BakedFrame], None] = lambda _frame: None,
) -> Work[list[Baked]]:
    """Bake guides up to a frame, as work in steps: a computation a frame.

    The scene is at the frame where it was, on every way out. starts_over: simulate frames again that are there; tell:
    called for each frame of each guides when it is written. Raises `HairError`.
    """
    global _baking
    present = scene_time.frame_of(scene)
    _baking = True
    with contextlib.ExitStack() as stack:
        stack.callback(_end, scene, present, [Remembered(guides) for guides in guides_list])
        tasks = [_begin(guides, last, scene, starts_over, stack) for guides in guides_list]
        yield Stage("Baking", 0.0)
        first = min((task.done for task in tasks), default=last)
        counts = [0] * len(tasks)
        for frame in range(first + 1, last + _BEYOND + 1):
            due = [(index, task) for index, task in enumerate(tasks) if task.done == frame - 1]
            scene_time.go_to(scene, frame)
            depsgraph = scenes.present_depsgraph()
            inputs = [_read(task, scene, depsgraph) for _, task in due]
            part = (frame - first) / (last + _BEYOND - first)
            yield _computing([task for _, task in due], inputs, frame, part, frame == last + _BEYOND)
            for index, task in due:
                task.done = frame
                counts[index] += 1
                tell(_baked_frame(task, frame))
        for task in tasks:
            task.writer.complete()
    return [Baked(task.simulated.settings.start_frame, last, *pair) for task, pair in _results(tasks, counts)]


def _baked_frame(task, frame):
    simulation = task.simulated.simulation
    return BakedFrame(task.name, frame, simulation.substeps, len(simulation.broken), task.writer.folder)


def _results(tasks, counts):
    return [(task, (count, task.broken)) for task, count in zip(tasks, counts, strict=True)]


def _end(scene, present, baked):
    """Go back to the frame where the scene was; guides are shown there, as baked, after the next update."""
    global _baking
    scene_time.go_to(scene, present)
    _baking = False
    for remembered in baked:
        with contextlib.suppress(HairError):  # deleted meanwhile, by a script
            frame_folders.have_changed(remembered.find())


def _begin(guides, last, scene, starts_over, stack):
    """A `_Task` that has come as far as frames and states are there already."""
    settings = properties.dynamics_of(guides.vellus)
    start = settings.start_frame
    if last < start:
        raise HairError(
            "The simulation begins in frame {start}, after the last frame to bake, {last}.", start=start, last=last
        )
    folder = frame_folders.new_folder(guides)
    frame_folders.forget(guides)
    if starts_over and (folder / frame_manifest.NAME).exists():
        frame_cache.remove(folder)
    scene_time.go_to(scene, start)
    simulated = guide_simulation.begin(guides, scene, scenes.present_depsgraph())
    rate = scene.render.fps / scene.render.fps_base
    layout = array_file.layout_of(simulated.simulation.save())
    combed = guide_simulation.combed_points(guides)
    guide_count, point_count = combed.shape[:2]
    keys = (key_of(guides, scene),)
    manifest = Manifest(keys, guide_count, point_count, start, last, rate, "baking", layout)
    writer = stack.enter_context(frame_cache.baking(folder, manifest))
    task = _Task(name_of(guides), Remembered(guides), simulated, writer, start)
    there = FrameCache(folder)
    if not _is_there(there, start, manifest.key):
        read = guide_simulation.read(guides, scene, scenes.present_depsgraph(), settings)
        writer.write_frame(start, combed, _digest(read))
        return task
    _go_on(task, there, guides, scene, manifest)
    return task


def _go_on(task, there, guides, scene, manifest):
    """Take the last state up to which all frames are there."""
    frame = task.done
    while _is_there(there, frame + 1, manifest.key):
        frame += 1
    for number in reversed([n for n in there.state_numbers() if manifest.first < n <= frame]):
        state = there.read_state(number)
        if state is None:
            continue
        scene_time.go_to(scene, number)
        read = guide_simulation.read(guides, scene, scenes.present_depsgraph(), task.simulated.settings)
        task.simulated.go_on(state, read)
        task.done = number
        return


def _is_there(there, frame, key):
    found = there.read_frame(frame)
    return found is not None and found.key == key


def _read(task, scene, depsgraph):
    guides = task.guides.find()
    settings = properties.dynamics_of(guides.vellus)
    if settings != task.simulated.settings:  # keyed
        task.simulated.change(settings)
    return guide_simulation.read(guides, scene, depsgraph, settings)


def _computing(tasks, inputs, frame, part, is_last):
    """A function of (progress) that simulates a frame of some guides and writes it."""

    def compute(progress):
        progress(f"Frame {frame}", part)
        for task, read in zip(tasks, inputs, strict=True):
            points = task.simulated.advance(read)
            task.broken += len(task.simulated.simulation.broken)
            task.writer.write_frame(frame, points, _digest(read))
            if is_last or (frame - task.simulated.settings.start_frame) % STATE_FRAMES == 0:
                task.writer.write_state(frame, task.simulated.simulation.save())

    return compute


def _digest(read: FrameInput) -> str:
    """Digest of the animation in a frame: roots, and the bounds of colliders."""
    bounds = [bound for one in read.world.obstacles for bound in (one.vertices.min(axis=0), one.vertices.max(axis=0))]
    roots = read.pose.root_positions
    return frame_manifest.digest(np.float32(np.concatenate([roots, *[bound[None] for bound in bounds]])))
