# SPDX-License-Identifier: GPL-3.0-or-later
"""The status of simulated or baked guides in the Dynamics panel, updated on changes and cached for drawing."""

from dataclasses import dataclass
from typing import Any

from ...core.errors import HairError
from ..data import scene
from ..data.simulation import frame_animation, varied_dynamics
from ..data.surfaces import cage_of
from ..groom import staleness
from ..groom.dynamics import frame_folders, guide_baking
from ..groom.guides import guide_regions
from ..host import notices, running, scene_time
from ..host.caches import Cache
from ..settings import properties, shared_wetness

_BAKED_OTHERWISE = "Frames {first} to {last} are baked with other settings or guides: bake again"
_OTHER = {
    frame_animation.SURFACE: "Frames from {frame} on are baked with another animation of the surface: bake again",
    frame_animation.SURROUNDINGS: "Frames from {frame} on are baked with other colliders, forces or keys: bake again",
}


@dataclass
class _State:
    """The status of some guides and the inputs it was computed from."""

    marks: tuple[Any, ...]
    sentence: str
    values: dict[str, Any]


state_cache = Cache()  # session_uid of guide Curves → _State
# session_uid of guide Curves → (FrameCache, {frame: the part of the animation that changed since the bake})
change_cache = Cache()
map_status_cache = Cache()  # session_uid of guide Curves → sentence about a missing source of their maps


def state_of(guides):
    """Return (sentence, values) for the panel: the baked or simulated frames of guides, and changes since."""
    state = state_cache.get(guides.session_uid)
    return _unknown() if state is None else (state.sentence, state.values)


def note(guides, blender_scene, played):
    """Update the result of `state_of`; played: the simulation of the guides by `simulated_hair`, or None."""
    baked = frame_folders.frames_of(guides)
    if baked is not None and baked.manifest is not None:
        marks = (baked.manifest, _first_change(guides), *_inputs(guides, blender_scene))
        known = state_cache.get(guides.session_uid)
        if known is not None and known.marks == marks:
            return
        status = _of_baked(baked.manifest, guides, blender_scene)
    else:
        marks, status = (), _unknown() if played is None else _of_played(played, scene_time.frame_of(blender_scene))
    state_cache.keep(guides.session_uid, _State(marks, *status))


def maps_changed(guides):
    """Note that maps of guides, or their sources, may have changed: `note` and `map_status_of` read them again."""
    for cache in (state_cache, map_status_cache):
        cache.invalidate(guides.session_uid)


def map_status_of(guides):
    """Return a sentence about a missing source of the maps of guides; its setting keeps its value.

    Raises `HairError` for an invalid surface.
    """
    return map_status_cache.get(
        guides.session_uid, lambda: varied_dynamics.present(guides, scene.last_depsgraph()).status
    )


def note_combed(guides, blender_scene, played):
    """Update the status of combed guides once per stroke: they differ from the baked guides."""
    known = state_cache.get(guides.session_uid)
    if known is None or known.sentence != _BAKED_OTHERWISE:
        note(guides, blender_scene, played)


def check_animation(guides, frame, blender_scene, depsgraph):
    """Note whether the animation has changed since the current frame of a depsgraph was baked.

    frame: `frame_cache.Frame` of the scene's current frame.
    """
    changed, number = _changes(guides), scene_time.frame_of(blender_scene)
    try:
        settings = properties.dynamics_of(guides.vellus)
        now = frame_animation.digest_of(guides, blender_scene, depsgraph, settings)
        part = frame_animation.change(frame.digest, now, frame.is_carried)
    except HairError:  # invalid surface: baked frames are shown nevertheless
        part = frame_animation.SURFACE
    if part is None:
        changed.pop(number, None)
        return
    if not changed and not running.has_window():
        notices.say(f'Guides "{notices.name_of(guides)}": {_OTHER[part].format(frame=number)}.')
    changed[number] = part


def _changes(guides):
    """Return {frame: changed part of the animation} of the current bake."""
    baked, known = frame_folders.frames_of(guides), change_cache.get(guides.session_uid)
    if known is None or known[0] is not baked:
        known = change_cache.keep(guides.session_uid, (baked, {}))
    return known[1]


def _first_change(guides):
    """Return (frame, changed part of the animation) of the first changed frame that was shown, or None."""
    return min(_changes(guides).items(), default=None)


def _inputs(guides, blender_scene):
    """Return the inputs of `guide_baking.key_of`, which are fast to read."""
    state, rate = guides.vellus, scene_time.animation_rate(blender_scene)
    units = blender_scene.unit_settings.scale_length
    parted = guide_regions.parting_keys(guides)
    wet_places = () if shared_wetness.is_keyed(state) else tuple(shared_wetness.masked_styles(state))
    digest = staleness.guides_digest(guides)
    return properties.dynamics_of(state), digest, cage_of(state.topology), rate, units, parted, wet_places


def _unknown():
    return "Not simulated yet: play from the start frame, or bake", {}


def _of_played(played, frame):
    if played.outdated is not None:
        return "Frames up to {frame} were simulated with other settings: play from the start", {
            "frame": played.outdated
        }
    if frame > played.frame:
        return "Simulated up to frame {frame}; frames after it were skipped: play from there", {"frame": played.frame}
    simulation = played.simulated.simulation
    values = {"frame": played.frame, "count": simulation.substeps}
    if simulation.required_substeps > simulation.substeps:
        return (
            "Simulated up to frame {frame} with {count} substeps per frame, but motion needs {asked}:"
            " use Automatic Substeps",
            {**values, "asked": simulation.required_substeps},
        )
    return "Simulated up to frame {frame} with {count} substeps per frame", values


def _of_baked(manifest, guides, blender_scene):
    values = {"first": manifest.first, "last": manifest.last}
    if manifest.guide_count != len(guides.curves):
        return "The baked frames belong to other guides: bake again", {}
    if guide_baking.changed_parts(guides, blender_scene, manifest):
        return _BAKED_OTHERWISE, values
    change = _first_change(guides)
    if change is not None:
        return _OTHER[change[1]], {"frame": change[0]}
    if manifest.state != "complete":
        return "Frames {first} to {last} are partly baked: Bake Dynamics continues", values
    return "Frames {first} to {last} are baked", values
