# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivery: hair of baked guides → frames in a USD file, which Blender plays without the add-on."""

import contextlib
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.files import file_names
from ...core.files.atomic_file import atomic_file, require_writable_path
from ...core.long_work import Stage
from ..data import scene, whole_changes
from ..data.strands import curves, delivered_hair, simulated_guides
from ..groom import selection
from ..groom.dynamics import frame_folders
from ..host import running, scene_time
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..live import live_hair
from . import strand_arrays
from .usd import hair_file


@dataclass(frozen=True)
class Delivered:
    """Delivered hair: the file, its frames, the number of strands and the file size [bytes]."""

    path: Path
    first: int
    last: int
    strand_count: int
    byte_count: int


@dataclass
class _Task:
    """Hair during delivery."""

    hair: Remembered
    probe: Remembered
    counts: np.ndarray  # points of strands
    path: str = ""  # in the file


def path_of(guides, blend_path=None):
    """Return the file for delivered hair of some guides, beside a .blend (None: the open one). Raises `HairError`.

    Hair of other guides does not play this file.
    """
    if blend_path is None:
        if not bpy.data.filepath:
            raise HairError("Hair is delivered to a file beside the .blend file: save the file first.")
        blend_path = Path(bpy.data.filepath)
    others = [hair for hair in bpy.data.hair_curves if hair.vellus.guide_curves != guides]
    played = {str(path).casefold() for hair in others for path in delivered_hair.files_of(hair)}

    def place(stem):
        return blend_path.with_name(f"{blend_path.stem}_{stem}.usdc")

    return place(file_names.free_stem(name_of(guides), lambda stem: str(place(stem).resolve()).casefold() in played))


@whole_changes.whole
def delivering(guides, path, blender_scene):
    """Write the hair of baked guides to a file and let the hair play it, as work in steps, one per sample.

    Samples are the frames of the scene and the next one; with motion blur, also the times between frames that Cycles
    samples. The scene's time is always restored. Raises `HairError`.
    """
    frames = scene_time.scene_frames()
    frame_folders.require_frames(guides, range(frames.start, frames.stop + 1))
    chosen = _deliverable(guides)
    hair_file.require_ours(path)
    require_writable_path(path)
    times = _times(blender_scene, frames, chosen)
    present, its_scene, its_guides = scene_time.time_of(blender_scene), Remembered(blender_scene), Remembered(guides)
    with contextlib.ExitStack() as stack:
        stack.callback(_go_back, its_scene, present)
        tasks = [_begin(hair, stack) for hair in chosen]
        units = scene_time.frame_rate(blender_scene), strand_arrays.meters_per_unit(blender_scene)
        yield Stage("Delivering", 0.0)
        with atomic_file(path) as partial:
            with hair_file.HairFile(partial, path, *units) as file:
                for task in tasks:
                    task.path = file.add(name_of(task.hair.find()), task.counts)
                for index, time in enumerate(times):
                    blender_scene = its_scene.find()  # undo replaces it
                    go_to(blender_scene, time)
                    require_shown(its_guides.find(), time)
                    read = [_read(task, time) for task in tasks]
                    in_file = time * scene_time.remapping(
                        blender_scene
                    )  # Blender looks samples up by the animation's time
                    yield _writing(file, tasks, read, in_file, (f"Frame {time:g}", index / len(times)))
            byte_count = partial.stat().st_size
            delivered_hair.close_files(path)
    cache_file = delivered_hair.open_file(path)
    baked = frame_folders.frames_of(its_guides.find())
    # There are no baked frames if the guides start to move after the last frame.
    key = "" if baked is None or baked.manifest is None else baked.manifest.key
    for task in tasks:
        hair = task.hair.find()
        delivered_hair.deliver(hair, cache_file, task.path)
        hair.vellus.delivered_key = key
    strand_count = sum(len(task.counts) for task in tasks)
    return Delivered(path, frames[0], frames[-1], strand_count, byte_count)


def take_off(guides):
    """Let delivered hair follow its guides again; returns the number of changed hair Curves. Keeps the file."""
    delivered = [hair for hair in curves.followers(guides) if delivered_hair.is_delivered(hair)]
    if not delivered:
        raise HairError('No hair of the guides "{name}" plays delivered frames.', name=name_of(guides))
    for hair in delivered:
        curves.require_overridable(hair)
        for user in delivered_hair.objects_of(hair):
            delivered_hair.take_off(user)
        hair.vellus.delivered_key = ""
    return len(delivered)


def _deliverable(guides):
    """Hair Curves that follow the guides and have objects in the view layer. Raises `HairError`."""
    layer = bpy.context.view_layer
    chosen = [hair for hair in curves.followers(guides) if selection.object_of(hair, layer) is not None]
    if not chosen:
        raise HairError('No hair in this view layer follows the guides "{name}".', name=name_of(guides))
    for hair in chosen:
        curves.require_overridable(hair)
        if not len(hair.curves):
            raise HairError('"{name}" has no strands.', name=name_of(hair))
    return chosen


def _times(blender_scene, frames, chosen):
    """Return the sample times, sorted, including the exposure of the first and the last frame."""
    steps = [_motion_steps(user) for hair in chosen for user in delivered_hair.objects_of(hair)]
    between = scene_time.exposure_times(blender_scene, max(steps))
    sampled = {frame + offset for frame in frames for offset in between}
    return sorted(sampled | {float(frame) for frame in (*frames, frames.stop)})


def _motion_steps(hair_object):
    """Cycles' steps of an object's motion blur; 1 where Cycles is off."""
    cycles = getattr(hair_object, "cycles", None)
    return min(getattr(cycles, "motion_steps", 1), 7)


def _begin(hair, stack):
    probe = delivered_hair.new_probe(selection.object_of(hair, bpy.context.view_layer))
    remembered = Remembered(probe)
    stack.callback(_remove, remembered)
    return _Task(Remembered(hair), remembered, curves.point_counts(hair))


def _remove(remembered):
    with contextlib.suppress(HairError):  # deleted by a script in the meantime
        bpy.data.objects.remove(remembered.find())


def _go_back(its_scene, time):
    with contextlib.suppress(HairError):  # the scene was deleted in the meantime
        go_to(its_scene.find(), time)


def go_to(blender_scene, time):
    """Set the time and update hair as if no long operation were running."""
    with running.set_aside():
        scene_time.go_to_time(blender_scene, time)
        live_hair.write_all()
        bpy.context.view_layer.update()


def require_shown(guides, time):
    """Raise `HairError` if a baked frame could not be read: guides would have their combed shape."""
    if time > guides.vellus.dynamics.start_frame and not simulated_guides.is_shown(guides):
        raise HairError(
            'Frame {frame} of the guides "{name}" cannot be read: bake it again.',
            frame=f"{time:g}",
            name=name_of(guides),
        )


def _read(task, time):
    """Return (points, radii, matrix) of evaluated hair at the present time. Raises `HairError`."""
    evaluated = task.probe.find().evaluated_get(scene.present_depsgraph())
    if not np.array_equal(curves.point_counts(evaluated.data), task.counts):
        name, frame = name_of(task.hair.find()), f"{time:g}"
        raise HairError(
            'The number of strands of "{name}" changes in frame {frame}: remove its keys.', name=name, frame=frame
        )
    points = curves.read_points(evaluated.data)
    if not np.isfinite(points).all():
        name, frame = name_of(task.hair.find()), f"{time:g}"
        raise HairError('"{name}" has non-finite coordinates in frame {frame}.', name=name, frame=frame)
    return points, curves.read_radii(evaluated.data), np.array(evaluated.matrix_world)


def _writing(file, tasks, read, time, step):
    """Return a function of (progress) that writes the samples of one time; step: arguments of progress."""

    def write(progress):
        progress(*step)
        for task, sample in zip(tasks, read, strict=True):
            file.write(time, task.path, *sample)
        file.save(time)

    return write
