# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of baked frames: one for each guides datablock, inside the cache folder of its settings."""

import contextlib
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np
from bpy.types import Curves, Scene

from ....core.errors import HairError
from ....core.files import frame_cache, frame_manifest
from ....core.files.frame_cache import FrameCache
from ...data import surface_space
from ...data.strands import attributes, curves, delivered_hair
from ...data.strands.curves import followers
from ...host import paths, scene_time
from ...host.caches import Cache
from ...host.notices import name_of

_CLOSE = 1e-5  # fraction of coordinates

folder_cache = Cache()  # session_uid of guide Curves → (folder, its loaded FrameCache)


def folder_of(guides: Curves) -> Path:
    """Return the folder of the frames of guides, whether it exists or not. Raises `HairError` if the path is invalid.

    Linked guides have the folder of the file that links them: each shot has frames of its own, even if several shots
    are saved in one folder.
    """
    base = paths.resolve(guides.vellus.cache_folder)
    return frame_cache.folder_of(base, _identity_of(guides, _file_seen_from(base)))


def _identity_of(guides, file):
    """Return the name of the folder of guides baked by a file; file: from `_file_seen_from` the parent folder."""
    if attributes.is_from_library(guides):  # the stored identity is that of the library
        linked_from = None if guides.library is None else paths.from_open_file(guides.library)
        return _identity_of_names(name_of(guides), linked_from, file)
    return guides.vellus.cache_identity or _identity_of_names(name_of(guides), None, file)


def _identity_of_names(guides, library, file):
    """Return an identity that is the same in every session, even if a file was not saved after baking."""
    return frame_manifest.digest([guides, library, file])[:16]


def _file_seen_from(base):
    """Return the path of the open file relative to a folder of caches, so both can be moved; "." if unsaved."""
    if not bpy.data.filepath:
        return "."
    file = Path(bpy.data.filepath)
    return paths.relative(file.parent.resolve() / file.name, base)


def frames_of(guides: Curves) -> FrameCache | None:
    """Return the baked frames of guides, possibly none; None if the path of their folder is invalid.

    Linked guides that are not baked in this file use the frames of the file that it was saved from, or else of their
    library.
    """
    known = folder_cache.get(guides.session_uid)
    try:
        folder = folder_of(guides) if _leads_somewhere(guides) else None
        if known is None or known[0] != folder:
            known = folder_cache.keep(guides.session_uid, (folder, _read(guides, folder)))
    except HairError:
        return None
    if known[1] is not None:
        known[1].space = surface_space.applied(guides)
    return known[1]


def rooted(guides: Curves, points: np.ndarray) -> np.ndarray:
    """Return the (G, P, 3) points of a frame with the exact roots of the guides, except of guides that were slid.

    Hair is bound to guides by their roots, and changes of coordinates round these.
    """
    roots = curves.first_points(guides)
    if surface_space.applied(guides).is_identity or len(roots) != len(points):
        return points
    is_close = np.linalg.norm(points[:, 0] - roots, axis=1) <= _CLOSE * abs(roots).max(initial=0.0)
    points = points.copy()
    points[is_close, 0] = roots[is_close]
    return points


def _leads_somewhere(guides):
    return bool(bpy.data.filepath) or not guides.vellus.cache_folder.startswith("//")


def _read(guides, folder):
    """Return the `FrameCache` of a folder, or of another folder with frames if it is None or has none."""
    read = None if folder is None else FrameCache(folder)
    if read is not None and read.manifest is not None:
        return read
    others = map(FrameCache, _other_folders(guides, folder))
    return next((other for other in others if other.manifest is not None), read)


def _other_folders(guides, folder):
    """Yield folders with frames of guides that were baked in other files; folder: from `folder_of`, or None."""
    before = scene_time.present_scene().vellus.baked_in
    if folder is not None and before and attributes.is_from_library(guides):
        yield frame_cache.folder_of(folder.parent, _identity_of(guides, before))
    if guides.library is not None:
        base = paths.resolve(guides.vellus.cache_folder, guides.library)
        file = paths.relative(paths.of_library(guides.library), base)
        identity = guides.vellus.cache_identity or _identity_of_names(name_of(guides), None, file)
        yield frame_cache.folder_of(base, identity)


def remember() -> None:
    """Store the location of frames in the open file before it is saved, so that they play under another name too."""
    for guides in simulating():
        baked = frames_of(guides)
        with contextlib.suppress(HairError):  # the folder path is invalid
            if baked is None or baked.manifest is None or baked.folder != folder_of(guides):
                continue
            if not attributes.is_from_library(guides):
                guides.vellus.cache_identity = baked.folder.name
                continue
            for scene in bpy.data.scenes:
                if scene.library is None:
                    scene.vellus.baked_in = _file_seen_from(baked.folder.parent)


def new_folder(guides: Curves) -> Path:
    """Assign a new bake folder to guides that have none or share it with other guides; return the guides' folder."""
    folder = folder_of(guides)
    if attributes.is_from_library(guides):
        return folder
    others = {other.vellus.cache_identity for other in bpy.data.hair_curves if other != guides} - {""}
    identity = folder.name
    guides.vellus.cache_identity = frame_cache.new_identity() if identity in others else identity
    return folder_of(guides)


def require_baked(numbers: Iterable[int], scene: Scene) -> None:
    """Raise `HairError` unless all simulated guides have readable baked frames for rendering frames of a scene.

    Checks frames from their start frame on. Renders of sequences call this, as they never simulate. Delivered hair
    needs no baked frames.
    """
    numbers = list(numbers)
    exposed = sorted({frame for number in numbers for frame in scene_time.exposed_frames(scene, number)})
    for guides in rendered(exposed[-1]):
        require_frames(guides, exposed)
    require_readable(numbers, scene)


def require_readable(numbers: Iterable[int], scene: Scene) -> None:
    """Raise `HairError` if baked frames for rendering frames of a scene cannot be read.

    Includes adjacent frames, which are read for motion. Every picture calls this: guides would have their combed shape.
    """
    is_moving = scene.render.use_motion_blur or any(layer.use_pass_vector for layer in scene.view_layers)
    beside = range(-2, 3) if is_moving else range(1)
    shown = sorted({number + offset for number in numbers for offset in beside})
    for guides in rendered(shown[-1]):
        fault = fault_of(guides, shown)
        if fault is not None:
            raise fault


def rendered(last: int) -> list[Curves]:
    """Return the simulated guides whose baked frames are rendered up to a frame; guides of delivered hair are not."""

    def is_read(guides):
        hair = followers(guides)
        is_all_delivered = bool(hair) and all(map(delivered_hair.is_delivered, hair))
        return guides.vellus.dynamics.start_frame < last and not is_all_delivered

    return [guides for guides in simulating() if is_read(guides)]


def require_frames(guides: Curves, numbers: Iterable[int]) -> None:
    """Raise `HairError` unless guides are simulated and all of these frames, from their start frame on, are baked."""
    if not is_simulated(guides):
        raise HairError('The guides "{name}" are not simulated: switch Dynamics on.', name=name_of(guides))
    numbers, start = list(numbers), guides.vellus.dynamics.start_frame
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
    fault = fault_of(guides, numbers)
    if fault is not None:
        raise fault


def fault_of(guides: Curves, numbers: Iterable[int]) -> HairError | None:
    """Return the error of the first of these baked frames of guides that cannot be read; None if all can.

    Missing frames are ignored.
    """
    baked = frames_of(guides)
    if baked is None or baked.manifest is None or baked.manifest.guide_count != len(guides.curves):
        return None
    for number in numbers:
        if number >= guides.vellus.dynamics.start_frame and baked.fault_of(number) is not None:
            sentence = 'Frame {frame} of the guides "{name}" cannot be read: bake it again.'
            return HairError(sentence, frame=f"{number:g}", name=name_of(guides))
    return None


def simulating() -> list[Curves]:
    """Return the simulated guide Curves, except those of a library that this file overrides."""
    overrides = (guides.override_library for guides in bpy.data.hair_curves)
    replaced = {override.reference for override in overrides if override is not None}
    return [guides for guides in bpy.data.hair_curves if is_simulated(guides) and guides not in replaced]


def is_simulated(guides: Curves) -> bool:
    """Whether guide Curves are simulated."""
    state = guides.vellus
    return state.kind == "GUIDES" and state.simulates and state.is_live


def forget(guides: Curves) -> None:
    """Drop the cached folder contents after frames were written or removed."""
    folder_cache.invalidate(guides.session_uid)


def have_changed(guides: Curves) -> None:
    """Show the present baked frames of guides with the next update, after frames were written or removed."""
    forget(guides)
    guides.vellus.is_dynamics_stale = True
    guides.update_tag()


def has_frames(guides: Curves) -> bool:
    """Whether baked frames of the guides are known. Reads no file: panels call this on every redraw."""
    _folder, baked = folder_cache.get(guides.session_uid) or (None, None)
    return baked is not None and baked.manifest is not None
