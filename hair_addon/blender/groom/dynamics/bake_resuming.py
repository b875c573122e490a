# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that were baked before: how far they may stay, and the state that baking goes on from.

They may as long as they are of the present settings, guides and animation. So each of their frames is visited, which
also tells where colliders were when their topology changed.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from bpy.types import Curves, Scene

from ....core.files.frame_cache import FrameCache, Writer
from ....core.long_work import Stage, Work
from ...data import scene as scenes
from ...data.simulation import frame_animation
from ...host import scene_time
from ...host.datablocks import Remembered
from ...settings import properties
from . import broken_guides, guide_simulation
from .broken_guides import Broken
from .guide_simulation import FrameInput, GuideSimulation

_PAUSE = 0.1  # [s] between progress reports


@dataclass
class Task:
    """Guides during a bake."""

    name: str
    guides: Remembered
    simulated: GuideSimulation
    writer: Writer
    done: int  # last existing frame
    there: FrameCache  # frames baked earlier
    broken: int = 0
    worst: Broken = broken_guides.NONE
    seconds: float = 0.0  # that the frame at hand has taken so far
    numbers: set[int] = field(default_factory=set)  # of states that are there
    state: tuple[int, Mapping[str, np.ndarray], FrameInput] | None = None  # to go on from: frame, arrays, what was seen

    @property
    def last_number(self) -> int:
        """The last frame that frames may stay up to: beyond, there is no state to go on from."""
        return max(self.numbers, default=self.done)


def digest_of(guides: Curves, scene: Scene, settings: "guide_simulation.DynamicsSettings") -> str:
    """Digest of the animation in the current frame. Raises `HairError`."""
    return frame_animation.digest_of(guides, scene, scenes.present_depsgraph(), settings)


def going_on(tasks: list[Task], its_scene: Remembered) -> Work[None]:
    """Bring tasks, which have come to their first frames, to the last states that the frames lead to; work in steps."""
    kept = {id(task): task.done for task in tasks if task.last_number > task.done}
    frame, said = min(kept.values(), default=0), time.perf_counter()
    while kept:
        frame += 1
        due, scene = [task for task in tasks if kept.get(id(task)) == frame - 1], its_scene.find()
        if due:
            scene_time.go_to(scene, frame)
        for task in due:
            if _may_stay(task, frame, scene) and frame < task.last_number:
                kept[id(task)] = frame
            else:
                del kept[id(task)]
        if time.perf_counter() - said > _PAUSE:
            yield Stage(f"Checking frame {frame}", 0.0)
            said = time.perf_counter()
    for task in tasks:
        if task.state is not None:
            task.done, arrays, seen = task.state
            task.simulated.go_on(arrays, seen)
        task.writer.remove_states(after=task.done)


def _may_stay(task, frame, scene):
    """Whether a frame is there, of the present settings and animation; its state is taken if it has one."""
    found = task.there.read_frame(frame)
    if found is None or found.key != task.writer.manifest.key:
        return False
    guides = task.guides.find()
    settings = properties.dynamics_of(guides.vellus)
    if found.digest != digest_of(guides, scene, settings):
        return False
    settings = guide_simulation.simulated(settings)
    read = guide_simulation.read(guides, scene, scenes.present_depsgraph(), settings, task.simulated.masks)
    seen = task.simulated.see(read)
    if frame in task.numbers:
        arrays = task.there.read_state(frame)
        if arrays is not None:
            task.state = frame, arrays, seen
    return True
