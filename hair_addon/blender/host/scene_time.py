# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene time: the current frame, changing frames, sub-frames, and the purpose of a dependency graph.

Code that depends on time uses these functions. A viewport's dependency graph is at the scene's current frame; a render
has its own dependency graph. `live/handlers.py` reacts to frame changes.
"""

import contextlib
import math

import bpy

from ...core.errors import HairError


def frame_of(blender_scene):
    """Return the current frame of a scene, original or evaluated."""
    return blender_scene.frame_current


def time_of(blender_scene):
    """Return the current time of a scene [frames], which is not whole while a render samples motion.

    Frames are those of the timeline, also if Time Stretching remaps the animation.
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
    """Return whether any window plays or scrubs the animation."""
    screens = [window.screen for manager in bpy.data.window_managers for window in manager.windows]
    return any(screen.is_animation_playing or screen.is_scrubbing for screen in screens)


def present_scene():
    """Return the active scene."""
    return bpy.context.scene


def scene_frames():
    """Return the frame range of the active scene."""
    return range(bpy.context.scene.frame_start, bpy.context.scene.frame_end + 1)


def go_to(blender_scene, frame):
    """Set a scene to a whole frame and evaluate it."""
    blender_scene.frame_set(frame)


def go_to_time(blender_scene, time):
    """Set a scene to a time [frames], which need not be whole, and evaluate it."""
    whole = math.floor(time)
    blender_scene.frame_set(whole, subframe=time - whole)


def frame_rate(blender_scene):
    """Return the frame rate of a scene [frames per second]."""
    return blender_scene.render.fps / blender_scene.render.fps_base


def remapping(blender_scene):
    """Return the animation frames per scene frame: below 1 in slow motion (Time Stretching)."""
    return blender_scene.render.frame_map_old / blender_scene.render.frame_map_new


def animation_rate(blender_scene):
    """Return the scene frames per second of the animation."""
    return frame_rate(blender_scene) / remapping(blender_scene)


def exposure_times(blender_scene, steps):
    """Return the times [frames], relative to a frame, at which Cycles samples motion; [0.0] without motion blur.

    steps: motion steps of the objects, as in Cycles: 2^steps + 1 times from the start to the end of the exposure.
    """
    render = blender_scene.render
    if not render.use_motion_blur or not render.motion_blur_shutter > 0.0:
        return [0.0]
    center = {"START": 0.5, "CENTER": 0.0, "END": -0.5}[render.motion_blur_position]
    count = 2**steps
    return [render.motion_blur_shutter * (center + index / count - 0.5) for index in range(count + 1)]


def exposed_frames(blender_scene, frame):
    """Return the range of whole frames that encloses the exposure of a frame; only that frame without motion blur."""
    ends = exposure_times(blender_scene, 0)
    return range(math.floor(frame + ends[0]), math.ceil(frame + ends[-1]) + 1)


def visit(blender_scene, offsets, set_frame):
    """Generate the indices of `offsets` with the scene at each time in turn, and restore the time afterwards.

    offsets: [frames] relative to the current time; set_frame: called with a whole frame and the fraction as
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
    """Whether data may be written now: a render runs in parallel to the interface unless the interface is locked."""
    return is_shown(depsgraph) or bpy.app.background or blender_scene.render.use_lock_interface


@contextlib.contextmanager
def outside_drivers():
    """Turn the error of evaluating a scene during its evaluation into a `HairError`, in a context."""
    try:
        yield
    except RuntimeError as error:
        raise HairError(
            "Blender is evaluating the scene: call this from an operator or a handler, not from a driver."
        ) from error
