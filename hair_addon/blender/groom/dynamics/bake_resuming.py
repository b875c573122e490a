# SPDX-License-Identifier: GPL-3.0-or-later
"""Resuming a bake: which earlier frames are still valid, and the state from which baking continues.

Frames are valid while settings, guides and animation match. Each frame is visited to compare its animation, and to find
the positions of colliders when their topology changed.
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
    seconds: float = 0.0  # time that the current frame has taken so far
    numbers: set[int] = field(default_factory=set)  # frames with a stored state
    state: tuple[int, Mapping[str, np.ndarray], FrameInput] | None = None  # to resume from: frame, arrays, input

    @property
    def last_number(self) -> int:
        """The last frame up to which earlier frames can be kept, as baking resumes only from a stored state."""
        return max(self.numbers, default=self.done)


def digest_of(guides: Curves, scene: Scene, settings: "guide_simulation.DynamicsSettings") -> str:
    """Return the digest of the animation in the current frame. Raises `HairError`."""
    return frame_animation.digest_of(guides, scene, scenes.present_depsgraph(), settings)


def resuming(tasks: list[Task], its_scene: Remembered) -> Work[None]:
    """Advance tasks from their first frames to the last valid states, as work in steps."""
    resumable = {id(task): task.done for task in tasks if task.last_number > task.done}
    frame, reported = min(resumable.values(), default=0), time.perf_counter()
    while resumable:
        frame += 1
        due, scene = [task for task in tasks if resumable.get(id(task)) == frame - 1], its_scene.find()
        if due:
            scene_time.go_to(scene, frame)
        for task in due:
            if _may_stay(task, frame, scene) and frame < task.last_number:
                resumable[id(task)] = frame
            else:
                del resumable[id(task)]
        if time.perf_counter() - reported > _PAUSE:
            yield Stage(f"Checking frame {frame}", 0.0)
            reported = time.perf_counter()
    for task in tasks:
        if task.state is not None:
            task.done, arrays, seen = task.state
            task.simulated.resume(arrays, seen)
        task.writer.remove_states(after=task.done)


def _may_stay(task, frame, scene):
    """Whether a frame exists and matches the present settings and animation.

    The task gets the frame's state, if it is stored.
    """
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
