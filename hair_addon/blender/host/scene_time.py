# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene time: the current frame, changing frames, sub-frames, and what a dependency graph is evaluated for.

Code that depends on time uses these functions. A viewport's dependency graph is at the scene's current frame; a render
has a dependency graph of its own. `live/handlers.py` reacts to frame changes.
"""

import contextlib
import math

import bpy

from ...core.errors import HairError


def frame_of(blender_scene):
    """Return the current frame of a scene, original or evaluated."""
    return blender_scene.frame_current


def time_of(blender_scene):
    """Return the current time of a scene in frames, between two of them while a render samples motion.

    Frames are numbered as the timeline has them, also where the animation's time is remapped.
    """
    return blender_scene.frame_current + blender_scene.frame_subframe


def present_frame():
    """Return the current frame of the active scene."""
    return frame_of(bpy.context.scene)


def is_playing():
    """Return whether the context's screen plays the animation."""
    screen = bpy.context.screen
    return screen is not None and screen.is_animation_playing


def is_shown_moving():
    """Return whether any window plays the animation, or its frame is dragged."""
    screens = [window.screen for manager in bpy.data.window_managers for window in manager.windows]
    return any(screen.is_animation_playing or screen.is_scrubbing for screen in screens)


def present_scene():
    """Return the active scene."""
    return bpy.context.scene


def scene_frames():
    """Return the frame range of the active scene."""
    return range(bpy.context.scene.frame_start, bpy.context.scene.frame_end + 1)


def go_to(blender_scene, frame):
    """Change a scene to a whole frame and evaluate it."""
    blender_scene.frame_set(frame)


def go_to_time(blender_scene, time):
    """Change a scene to a time in frames, which need not be whole, and evaluate it."""
    whole = math.floor(time)
    blender_scene.frame_set(whole, subframe=time - whole)


def frame_rate(blender_scene):
    """Return the frames a second of a scene."""
    return blender_scene.render.fps / blender_scene.render.fps_base


def remapping(blender_scene):
    """Return the frames of the animation in a frame of a scene: below one in slow motion (Time Stretching)."""
    return blender_scene.render.frame_map_old / blender_scene.render.frame_map_new


def animation_rate(blender_scene):
    """Return the frames of a scene in a second of its animation."""
    return frame_rate(blender_scene) / remapping(blender_scene)


def exposure_times(blender_scene, steps):
    """Return the times [frames] from a frame at which Cycles samples the motion of objects; [0.0] without motion blur.

    steps: of the objects, as Cycles has it: 2^steps + 1 times, from one end of the exposure to the other.
    """
    render = blender_scene.render
    if not render.use_motion_blur or not render.motion_blur_shutter > 0.0:
        return [0.0]
    center = {"START": 0.5, "CENTER": 0.0, "END": -0.5}[render.motion_blur_position]
    count = 2**steps
    return [render.motion_blur_shutter * (center + index / count - 0.5) for index in range(count + 1)]


def exposed_frames(blender_scene, frame):
    """Return the range of frames that an exposure of a frame lies between: that frame alone without motion blur."""
    ends = exposure_times(blender_scene, 0)
    return range(math.floor(frame + ends[0]), math.ceil(frame + ends[-1]) + 1)


def visit(blender_scene, offsets, set_frame):
    """Change a scene to several times in turn, and back afterwards: a generator of the indices of `offsets`.

    offsets: in frames, relative to the current time; set_frame: called with a whole frame and the fraction as
    `subframe`, like a render engine's `frame_set`.
    """

    def go(moment):
        whole = math.floor(moment)
        set_frame(whole, subframe=moment - whole)

    now = time_of(blender_scene)
    try:
        for index, offset in enumerate(offsets):
            if offset != 0.0 or any(offsets[:index]):
                go(now + offset)
            yield index
    finally:
        if any(offsets):
            go(now)


def is_shown(depsgraph):
    """Whether a depsgraph is evaluated for a viewport."""
    return depsgraph.mode == "VIEWPORT"


def is_rendered(depsgraph):
    """Whether a depsgraph is evaluated for a render."""
    return depsgraph.mode == "RENDER"


def may_write(blender_scene, depsgraph):
    """Whether data may be written now: a render runs in parallel to the interface unless that is locked."""
    return is_shown(depsgraph) or bpy.app.background or blender_scene.render.use_lock_interface


@contextlib.contextmanager
def outside_drivers():
    """Raise a `HairError` where Blender is asked, in a context, to evaluate a scene while it evaluates it."""
    try:
        yield
    except RuntimeError as error:
        raise HairError(
            "Blender evaluates the scene right now: call this from an operator or a handler, not from a driver."
        ) from error
