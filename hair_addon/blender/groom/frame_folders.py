# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the baked frames of guides are: a folder of theirs in the cache folder that they name."""

from collections.abc import Iterable
from pathlib import Path

import bpy
from bpy.types import Curves

from ...core.errors import HairError
from ...core.files import frame_cache, frame_manifest
from ...core.files.frame_cache import FrameCache
from ..data import delivered_hair
from ..data.curves import followers
from ..host import paths
from ..host.caches import Cache
from ..host.notices import name_of

folder_cache = Cache()  # session_uid of guide Curves → (folder, FrameCache): what was read of it


def folder_of(guides: Curves) -> Path:
    """The folder of the frames of some guides, whether it exists or not. Raises `HairError` if it leads nowhere."""
    identity = guides.vellus.cache_identity or _identity_of_name(guides)
    return frame_cache.folder_of(paths.resolve(guides.vellus.cache_folder), identity)


def _identity_of_name(guides):
    """The same in every session of a file that was not saved since guides were baked, as by the command line."""
    return frame_manifest.digest(name_of(guides))[:16]


def frames_of(guides: Curves) -> FrameCache | None:
    """The baked frames of some guides, of which there may be none; None where their folder leads nowhere."""
    if guides.vellus.cache_folder.startswith("//") and not bpy.data.filepath:
        return None
    try:
        folder = folder_of(guides)
    except HairError:
        return None
    kept = folder_cache.get(guides.session_uid)
    if kept is None or kept[0] != folder:
        kept = folder_cache.keep(guides.session_uid, (folder, FrameCache(folder)))
    return kept[1]


def new_folder(guides: Curves) -> Path:
    """The folder to bake some guides to: theirs, or a new one where they have none or share it with other guides."""
    state = guides.vellus
    others = {other.vellus.cache_identity for other in bpy.data.hair_curves if other != guides} - {""}
    identity = state.cache_identity or _identity_of_name(guides)
    state.cache_identity = frame_cache.new_identity() if identity in others else identity
    return folder_of(guides)


def require_baked(numbers: Iterable[int]) -> None:
    """Raise `HairError` unless all guides that simulate have baked frames of these numbers, from their start frame on.

    Renders of sequences ask: they never simulate. Hair that plays delivered frames needs no others.
    """
    for guides in simulating():
        hair = followers(guides)
        if not hair or not all(map(delivered_hair.is_delivered, hair)):
            require_frames(guides, numbers)


def require_frames(guides: Curves, numbers: Iterable[int]) -> None:
    """Raise `HairError` unless guides simulate, and have baked frames of these numbers from their start frame on."""
    if not is_simulated(guides):
        raise HairError('The guides "{name}" do not simulate: switch Dynamics on.', name=name_of(guides))
    start = guides.vellus.dynamics.start_frame
    baked = frames_of(guides)
    is_theirs = baked is not None and baked.manifest is not None and baked.manifest.guide_count == len(guides.curves)
    there = set(baked.frame_numbers()) if baked is not None and is_theirs else set()
    missing = [number for number in numbers if number > start and number not in there]
    if missing:
        raise HairError(
            'Frame {frame} of the guides "{name}" is not baked: bake their dynamics first.',
            frame=missing[0],
            name=name_of(guides),
        )


def simulating() -> list[Curves]:
    """Guide Curves that are simulated."""
    return [guides for guides in bpy.data.hair_curves if is_simulated(guides)]


def is_simulated(guides: Curves) -> bool:
    """Whether guide Curves are simulated."""
    state = guides.vellus
    return state.kind == "GUIDES" and state.simulates and state.is_live


def forget(guides: Curves) -> None:
    """Read the folder again when it is next asked for: frames were written or removed."""
    folder_cache.invalidate(guides.session_uid)


def have_changed(guides: Curves) -> None:
    """Show guides with the next update as they are baked now: frames were written or removed."""
    forget(guides)
    guides.vellus.is_dynamics_stale = True
    guides.update_tag()


def has_frames(guides: Curves) -> bool:
    """Whether frames of some guides are known: panels ask with every redraw, so no file is read."""
    kept = folder_cache.get(guides.session_uid)
    return kept is not None and kept[1].manifest is not None
