# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Dynamics panel says of simulated or baked guides: found when something has changed, and kept for panels."""

from dataclasses import dataclass
from typing import Any

from ...core.errors import HairError
from ..data.simulation import frame_animation
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
    """What is said of some guides, and what it follows from."""

    marks: tuple[Any, ...]
    sentence: str
    values: dict[str, Any]


state_cache = Cache()  # session_uid of guide Curves → _State
# session_uid of guide Curves → (FrameCache, {frame: what moves otherwise there than when it was baked})
change_cache = Cache()


def state_of(guides):
    """(sentence, values) for the panel: what is baked or simulated of some guides, and what has changed since."""
    state = state_cache.get(guides.session_uid)
    return _unknown() if state is None else (state.sentence, state.values)


def note(guides, blender_scene, played):
    """Find out what `state_of` says; played: what `simulated_hair` has simulated of the guides, or None."""
    baked = frame_folders.frames_of(guides)
    if baked is not None and baked.manifest is not None:
        marks = (baked.manifest, _first_change(guides), *_inputs(guides, blender_scene))
        known = state_cache.get(guides.session_uid)
        if known is not None and known.marks == marks:
            return
        said = _of_baked(baked.manifest, guides, blender_scene)
    else:
        marks, said = (), _unknown() if played is None else _of_played(played, scene_time.frame_of(blender_scene))
    state_cache.keep(guides.session_uid, _State(marks, *said))


def note_combed(guides, blender_scene, played):
    """Find it out of guides that were combed, once in a stroke: they are others than those that were baked."""
    known = state_cache.get(guides.session_uid)
    if known is None or known.sentence != _BAKED_OTHERWISE:
        note(guides, blender_scene, played)


def check_animation(guides, frame, blender_scene, depsgraph):
    """Note whether the animation is as when a frame was baked, which a depsgraph is evaluated for.

    frame: `frame_cache.Frame` of the scene's present one.
    """
    changed, number = _changes(guides), scene_time.frame_of(blender_scene)
    try:
        settings = properties.dynamics_of(guides.vellus)
        now = frame_animation.digest_of(guides, blender_scene, depsgraph, settings)
        what = frame_animation.change(frame.digest, now, frame.is_carried)
    except HairError:  # of the surface: baked frames are shown nevertheless
        what = frame_animation.SURFACE
    if what is None:
        changed.pop(number, None)
        return
    if not changed and not running.has_window():
        notices.say(f'Guides "{notices.name_of(guides)}": {_OTHER[what].format(frame=number)}.')
    changed[number] = what


def _changes(guides):
    """{frame: what moves otherwise} of the frames that are baked now."""
    baked, kept = frame_folders.frames_of(guides), change_cache.get(guides.session_uid)
    if kept is None or kept[0] is not baked:
        kept = change_cache.keep(guides.session_uid, (baked, {}))
    return kept[1]


def _first_change(guides):
    """(frame, what moves otherwise) of the first changed one that was shown, or None."""
    return min(_changes(guides).items(), default=None)


def _inputs(guides, blender_scene):
    """What `guide_baking.key_of` follows from, quickly read."""
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
        return "Frames up to {frame} have other settings: play from the start", {"frame": played.outdated}
    if frame > played.frame:
        return "Simulated up to frame {frame}, and frames after it were skipped: play from there", {
            "frame": played.frame
        }
    simulation = played.simulated.simulation
    values = {"frame": played.frame, "count": simulation.substeps}
    if simulation.asked_substeps > simulation.substeps:
        return (
            "Simulated up to frame {frame}, in {count} substeps a frame, where motion asks for {asked}:"
            " use Automatic Substeps",
            {**values, "asked": simulation.asked_substeps},
        )
    return "Simulated up to frame {frame}, in {count} substeps a frame", values


def _of_baked(manifest, guides, blender_scene):
    values = {"first": manifest.first, "last": manifest.last}
    if manifest.guide_count != len(guides.curves):
        return "The baked frames are of other guides: bake again", {}
    if guide_baking.changed_parts(guides, blender_scene, manifest):
        return _BAKED_OTHERWISE, values
    change = _first_change(guides)
    if change is not None:
        return _OTHER[change[1]], {"frame": change[0]}
    if manifest.state != "complete":
        return "Frames {first} to {last} are baked in part: Bake Dynamics goes on", values
    return "Frames {first} to {last} are baked", values
