# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the baked frames of guides are: a folder of theirs in the cache folder that they name."""

from pathlib import Path

import bpy
from bpy.types import Curves

from ...core.errors import HairError
from ...core.files import frame_cache
from ...core.files.frame_cache import FrameCache
from ..host import paths
from ..host.caches import Cache

folder_cache = Cache()  # session_uid of guide Curves → (folder, FrameCache): what was read of it


def folder_of(guides: Curves) -> Path:
    """The folder of the frames of some guides. Raises `HairError` where they have none, or it leads nowhere."""
    return frame_cache.folder_of(paths.resolve(guides.vellus.cache_folder), guides.vellus.cache_identity)


def frames_of(guides: Curves) -> FrameCache | None:
    """The baked frames of some guides; None where none were ever baked, or their folder leads nowhere."""
    state = guides.vellus
    if not state.cache_identity or (state.cache_folder.startswith("//") and not bpy.data.filepath):
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
    others = {other.vellus.cache_identity for other in bpy.data.hair_curves if other != guides}
    if not state.cache_identity or state.cache_identity in others:
        state.cache_identity = frame_cache.new_identity()
    return folder_of(guides)


def forget(guides: Curves) -> None:
    """Read the folder again when it is next asked for: frames were written or removed."""
    folder_cache.invalidate(guides.session_uid)
