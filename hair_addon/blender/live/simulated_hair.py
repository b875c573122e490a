# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides that are simulated while the timeline plays, and hair that follows them.

The frame after the last simulated frame is simulated when it is shown, and stored in memory; a jump simulates nothing.
Simulations are stored by the guides' session UID, without references to Blender's data.
"""

import math
import sys
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.errors import HairError
from ..data import scene, usable_surfaces
from ..data.simulation import wet_guides
from ..data.strands import curves, simulated_guides
from ..groom import bindings, hair_outside
from ..groom.dynamics import broken_guides, frame_folders, guide_baking, guide_simulation
from ..groom.dynamics.broken_guides import Broken
from ..groom.dynamics.guide_simulation import GuideSimulation, simulated
from ..groom.surfaces import applied_transforms
from ..host import running, scene_time
from ..host.caches import Cache
from ..settings import properties
from . import dynamics_state, live_hair

MOST_BYTES = 1 << 30  # of frames in memory


@dataclass
class _Played:
    """The simulation of some guides in this session, and its frames."""

    simulated: GuideSimulation
    frame: int  # the last simulated frame
    frames: dict[int, np.ndarray] = field(default_factory=dict)  # points by frame, local at rest
    outdated: int | None = None  # the last frame that was simulated with other settings
    wet_places: dict = field(default_factory=dict)  # of `wet_guides.places`, for the last simulated frame
    notes: tuple[HairError, ...] = ()
    worst: Broken = broken_guides.NONE


played_cache = Cache()  # session_uid of guide Curves → _Played

# session_uid of guide Curves on a surface of another scene → True until an update of that scene shows them
waiting_cache = Cache()


def follow_frame(blender_scene, depsgraph):
    """Move all simulated guides and their hair to the scene's time.

    For a viewport the next frame is simulated if it is not baked; a render only shows existing frames. Guides on
    surfaces of other scenes stay at the time of their scene.
    """
    if running.job() is not None or guide_baking.is_baking():
        return
    is_played = scene_time.is_shown(depsgraph) and running.has_window()
    time = scene_time.time_of(blender_scene)
    shown_in = depsgraph if scene_time.is_shown(depsgraph) else scene.present_depsgraph()
    for guides in _of_scene(frame_folders.simulating(), depsgraph):
        try:
            points = _points_at(guides, time, (blender_scene, depsgraph))
            if points is None and is_played and time == int(time):
                points = _play(guides, blender_scene, depsgraph)
            _show(guides, points, shown_in)
        except HairError as error:
            played_cache.invalidate(guides.session_uid)
            _show(guides, None, shown_in)
            guides.vellus.dynamics_status = str(error)
        else:
            _update_status(guides, blender_scene, points, time)


def _of_scene(simulating, depsgraph):
    """Return the simulated guides without a surface or with a surface in the scene of a depsgraph."""
    return [one for one in simulating if one.surface is None or usable_surfaces.is_in(one.surface, depsgraph)]


def _update_status(guides, blender_scene, points, time):
    """Update the status of guides shown at `points`: errors of settings or a baked frame, if any."""
    try:
        _note_state(guides, blender_scene)
        _require_readable(guides, time)
        is_known = frame_folders.has_frames(guides) or played_cache.get(guides.session_uid) is not None
        if points is not None or is_known:
            guides.vellus.dynamics_status = dynamics_state.map_status_of(guides)
    except HairError as error:
        guides.vellus.dynamics_status = str(error)


def _require_readable(guides, time):
    """Raise a `HairError` if a baked frame of guides at a time is damaged."""
    fault = frame_folders.fault_of(guides, sorted({math.floor(time), math.ceil(time)}))
    if fault is not None:
        raise fault


def follow_settings(blender_scene, depsgraph):
    """After an update, show guides whose simulation was disabled as combed, and note changes of settings."""
    for guides in bpy.data.hair_curves:
        state = guides.vellus
        _keep_shown_frame(guides, blender_scene)
        if simulated_guides.is_shown(guides) and not frame_folders.is_simulated(guides):
            played_cache.invalidate(guides.session_uid)
            _show(guides, None, depsgraph)
        if state.is_dynamics_stale and not guide_baking.is_baking():
            state.is_dynamics_stale = False
            _note_change(guides, blender_scene, depsgraph)


def note_combed(combed, blender_scene):
    """Note for the panel that guides were combed: existing frames are of the former guides."""
    for guides in frame_folders.simulating() if combed and not guide_baking.is_baking() else ():
        if guides in combed:
            try:
                dynamics_state.note_combed(guides, blender_scene, _played_now(guides))
            except HairError as error:
                guides.vellus.dynamics_status = str(error)


def show_known(simulating, blender_scene, depsgraph):
    """Show simulated guides at their known points. Loading, copying, undo and redo show them as combed.

    Guides on surfaces of other scenes wait for updates of these scenes.
    """
    here = _of_scene(simulating, depsgraph)
    for guides in simulating:
        waiting_cache.keep(guides.session_uid, True)
    for guides in here:
        waiting_cache.invalidate(guides.session_uid)
        try:
            live_hair.show_guides(guides, _known(guides, blender_scene), depsgraph)
            _note_state(guides, blender_scene)
            _require_readable(guides, scene_time.time_of(blender_scene))
        except HairError as error:
            guides.vellus.dynamics_status = str(error)


def show_waiting(blender_scene, depsgraph):
    """Show the guides that `show_known` left to an update of their scene."""
    if len(waiting_cache):
        waiting = [guides for guides in frame_folders.simulating() if waiting_cache.get(guides.session_uid)]
        here = _of_scene(waiting, depsgraph)
        if here:
            show_known(here, blender_scene, depsgraph)


def _follow_known(guides, blender_scene, depsgraph):
    """Show guides at their known points if they are shown elsewhere, as frames were baked or removed."""
    points, shown = _known(guides, blender_scene), simulated_guides.point_cache.get(guides.session_uid)
    if (points is None) != (shown is None) or (points is not None and not np.array_equal(points, shown)):
        _show(guides, points, depsgraph)


def _known(guides, blender_scene):
    """Points of guides at the scene's time, or in the last known frame before it; None for combed guides."""
    points = _points_at(guides, scene_time.time_of(blender_scene))
    played = _played_now(guides)
    if points is None and played is not None:
        points = _last_known(played, scene_time.frame_of(blender_scene))
    return points


def _note_change(guides, blender_scene, depsgraph):
    dynamics_state.maps_changed(guides)
    played = played_cache.get(guides.session_uid)
    if played is not None:
        played.simulated.masks.clear()  # to be read again
    try:
        if frame_folders.is_simulated(guides):
            _follow_known(guides, blender_scene, depsgraph)
            _write_again(guides)
        _note_state(guides, blender_scene)
        guides.vellus.dynamics_status = dynamics_state.map_status_of(guides)
    except HairError as error:
        guides.vellus.dynamics_status = str(error)


def _write_again(guides):
    """Write the hair of guides again if keeping it outside of colliders was enabled or disabled."""
    for hair in curves.followers(guides):
        bound = bindings.of(hair)
        if bound is not None and hair_outside.is_wanted(hair) != (bound.free is not None):
            bound.is_due()
            live_hair.write_soon(hair)


def _points_at(guides, time, checked_in=None):
    """Points of guides at a time [frames] if it is baked or was simulated in this session; else None.

    checked_in: (scene, depsgraph) of a viewport whose animation is compared with the baked frame's.
    """
    baked = frame_folders.frames_of(guides)
    if baked is not None and baked.manifest is not None and baked.manifest.guide_count == len(guides.curves):
        points = _baked_points(guides, baked, time, checked_in)
        for error in baked.take_errors():
            print(f"Vellus: {error}", file=sys.stderr)
        if points is not None:
            return frame_folders.rooted(guides, points)
    played = _played_now(guides)
    return None if played is None else played.frames.get(time)


def _baked_points(guides, baked, time, checked_in):
    if time != int(time):
        return baked.points_at(time)
    frame = baked.read_frame(int(time))
    if frame is None:
        return None
    if checked_in is not None and scene_time.is_shown(checked_in[1]):
        dynamics_state.check_animation(guides, frame, *checked_in)
    return frame.points


def _note_state(guides, blender_scene):
    dynamics_state.note(guides, blender_scene, played_cache.get(guides.session_uid))


def _play(guides, blender_scene, depsgraph):
    """Points of guides in an unknown frame: simulates the next frame, else the last known; None for combed guides."""
    frame, settings = scene_time.frame_of(blender_scene), properties.dynamics_of(guides.vellus)
    if frame <= settings.start_frame:
        if frame == settings.start_frame:
            _begin(guides, blender_scene, depsgraph)
        return None
    played = _played_now(guides)
    if played is None:
        return None
    if frame == played.frame + 1:
        _advance(played, guides, blender_scene, depsgraph, settings)
    return _last_known(played, frame)


def _played_now(guides):
    """Return the `_Played` of guides in this session; None if the guides have changed, so that they begin again."""
    played = played_cache.get(guides.session_uid)
    settings = properties.dynamics_of(guides.vellus)
    if played is None or played.simulated.is_of(guides, settings):
        return played
    if not _follow_applied(guides, played) or not played.simulated.is_of(guides, settings):
        played_cache.invalidate(guides.session_uid)
        return None
    return played


def _follow_applied(guides, played):
    """Keep frames in place if a transform was applied to the surface; returns whether nothing else changed."""
    roots = played.simulated.roots
    change = played.simulated.follow_applied(guides)
    if change is None:
        return False
    now = played.simulated.roots
    for frame, points in played.frames.items():
        played.frames[frame] = applied_transforms.with_exact_roots(change.points(points), points, roots, now)
    return True


def _keep_shown_frame(guides, blender_scene):
    """If a transform was just applied to the surface, keep the shown frame in place."""
    played, shown = played_cache.get(guides.session_uid), simulated_guides.point_cache.get(guides.session_uid)
    if played is None or shown is None or not played.simulated.has_other_space(guides):
        return
    frame = scene_time.frame_of(blender_scene)
    if _played_now(guides) is not None and frame in played.frames and len(shown) == len(guides.curves):
        played.frames[frame] = shown.copy()


def _last_known(played, frame):
    """Points of guides in a frame, or in the last known frame before it; None if there is none."""
    known = [number for number in played.frames if number <= frame]
    return played.frames[max(known)] if known else None


def _begin(guides, blender_scene, depsgraph):
    simulated = guide_simulation.begin(guides, blender_scene, depsgraph)
    wet_places = wet_guides.places(guides, simulated.masks)
    frame = scene_time.frame_of(blender_scene)
    played_cache.keep(guides.session_uid, _Played(simulated, frame, wet_places=wet_places))


def _advance(played, guides, blender_scene, depsgraph, settings):
    """Simulate one more frame with the current settings."""
    settings = simulated(settings)
    before = played.simulated.settings
    if guide_simulation.unkeyed(guides, settings) != guide_simulation.unkeyed(guides, before):
        played.outdated = played.frame
    if played.simulated.follow_parting(guides, depsgraph):
        played.outdated = played.frame
    read = guide_simulation.read(guides, blender_scene, depsgraph, settings, played.simulated.masks)
    if not read.varied.is_same(played.simulated.varied):
        played.outdated = played.frame
    wet_places = wet_guides.places(guides, played.simulated.masks)
    if wet_guides.are_others(wet_places, played.wet_places, guides):
        played.outdated = played.frame
    played.wet_places = wet_places
    points = played.simulated.advance(read)
    played.frame += 1
    played.worst = max(played.worst, Broken(len(played.simulated.simulation.broken), played.frame))
    played.notes = played.simulated.errors
    played.frames[played.frame] = points
    while len(played.frames) > 1 and points.nbytes * len(played.frames) > MOST_BYTES:
        del played.frames[next(iter(played.frames))]


def _show(guides, points, depsgraph):
    if points is None and not simulated_guides.is_shown(guides):
        return
    if points is not None and len(points) != len(guides.curves):
        return
    live_hair.show_guides(guides, points, depsgraph)


def notes_of(guides):
    """Errors of colliders and force fields that the last played frame leaves out, and of broken guides."""
    played, worst = played_cache.get(guides.session_uid), broken_guides.baked(guides)
    if not worst.count and played is not None:
        worst = played.worst
    broken = (worst.message_of(guides),) if worst.count else ()
    return broken if played is None else (*played.notes, *broken)


PLAY_EVERY_FRAME = "NONE"  # of `Scene.sync_mode`

before_cache = Cache()  # session_uid of a scene → its former `sync_mode`


def begin(blender_scene):
    """Let the next playback of a scene show every frame; returns whether the scene changed."""
    if blender_scene.sync_mode == PLAY_EVERY_FRAME:
        return False
    before_cache.keep(blender_scene.session_uid, blender_scene.sync_mode)
    blender_scene.sync_mode = PLAY_EVERY_FRAME
    return True


def end():
    """Restore the playback settings that `begin` changed, unless they were changed again since."""
    for blender_scene in bpy.data.scenes:
        before = before_cache.get(blender_scene.session_uid)
        if before is not None and blender_scene.sync_mode == PLAY_EVERY_FRAME:
            blender_scene.sync_mode = before
    before_cache.clear()
