# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that renders of a scene read, and which of them are missing or damaged: linked libraries, images, IES profiles,
mesh caches, volumes.

Without such files, Blender renders black or otherwise wrong pictures, and reports success.
"""

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import imbuf

from ....core.errors import HairError
from ....core.imaging import whole_images
from ...host.caches import Cache
from . import live_nodes

MOST_NAMED = 4  # maximum number of missing files in a sentence

IMAGE, PROFILE = "image", "IES profile"

readable_cache = Cache(capacity=4096)  # (path, time of the last change [ns], size) → whether the file can be read

_OWNERS_WITH_NODES = (bpy.types.Material, bpy.types.World, bpy.types.Light, bpy.types.NodeTree)


@dataclass(frozen=True)
class RenderedFile:
    """A file of a scene, or a series of files by number or tile.

    name: path in the .blend; paths: files that the given frames need; siblings: all files of a numbered series.
    """

    name: str
    paths: tuple[Path, ...]
    kind: str = ""  # `IMAGE`, `PROFILE`, or empty for other files
    siblings: tuple[Path, ...] = ()


def require(scene: bpy.types.Scene, numbers: Iterable[int]) -> None:
    """Raise a `HairError` with the names of missing files, if these frame numbers need any."""
    names = missing(scene, numbers)
    if names:
        raise HairError(
            "Files are missing or damaged: {names}; restore or relink them, or render without them by --allow-missing.",
            names=in_short(names),
        )


def in_short(names: list[str]) -> str:
    """Return the first names, and the number of the others, for a sentence."""
    rest = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" + {rest}" if rest > 0 else "")


def missing(scene: bpy.types.Scene, numbers: Iterable[int]) -> list[str]:
    """Names of files that are missing or unreadable, and of datablocks that are missing in their library."""
    reached = _reached(scene)
    names = [_name_of_missing(datablock) for datablock in reached if datablock.is_missing]
    names += [file.name for file in _files(reached, list(numbers)) if not all(map(_reader_of(file), file.paths))]
    return sorted({*names})


def states(scene: bpy.types.Scene) -> dict[str, str]:
    """Return {name: state} of all files that a scene reads in any frame, to detect changed files.

    A state is the size and the time of change [s], or "missing"; for a numbered series a digest of its files' states.
    """
    reached, found = _reached(scene), {}
    for library in {datablock.library for datablock in reached} - {None}:
        found[library.filepath] = _state((_absolute(library.filepath, library.parent),))
    for file in _files(reached, []):
        found[file.name] = _state(file.siblings or file.paths)
    return dict(sorted(found.items()))


def _state(paths):
    marks = []
    for path in paths:
        try:
            status = path.stat()
        except OSError:
            marks.append("missing")
        else:
            marks.append(f"{status.st_size} {int(status.st_mtime)}")
    if len(paths) == 1:
        return marks[0]
    text = "\n".join(f"{path.name} {mark}" for path, mark in zip(paths, marks, strict=True))
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _name_of_missing(datablock):
    library = datablock.library
    path = library.filepath
    if not _is_there(_absolute(path, library.parent)):
        return path
    return f'{path} ({datablock.bl_rna.name} "{datablock.name}")'


def _reached(scene):
    """All datablocks that renders of a scene use, directly or indirectly, without data of the interface."""
    used = {}
    for datablock, users in bpy.data.user_map().items():
        for user in users:
            used.setdefault(user, []).append(datablock)
    reached, left = {scene: None}, [scene]
    while left:
        user = left.pop()
        named = _named_images(user) if isinstance(user, bpy.types.Curves) else ()
        for datablock in (*used.get(user, ()), *named):
            if datablock not in reached and _is_rendered(user, datablock):
                reached[datablock] = None
                left.append(datablock)
    return list(reached)


def _is_rendered(user, datablock):
    """Whether a render shows `datablock`, which `user` uses."""
    if isinstance(datablock, (bpy.types.Brush, bpy.types.Palette, bpy.types.MovieClip, bpy.types.Sound)):
        return False
    if not isinstance(datablock, bpy.types.Image):
        return True
    if isinstance(user, _OWNERS_WITH_NODES):
        return any(image == datablock for image, _node in live_nodes.images(user))
    # Scenes use images for painting; cameras and empties show images in viewports.
    is_shown = isinstance(user, (bpy.types.Scene, bpy.types.Camera))
    return not is_shown and not (isinstance(user, bpy.types.Object) and user.type == "EMPTY")


def _named_images(curves):
    """Images of masks in the settings of hair."""
    owners = [curves.vellus.hair, curves.vellus.guides, *curves.vellus.styles]
    names = {getattr(owner, name) for owner in owners for name in owner.bl_rna.properties.keys() if "image" in name}
    images = (bpy.data.images.get(name) for name in names if isinstance(name, str) and name)
    return [image for image in images if image is not None]


def _files(reached, numbers) -> Iterator[RenderedFile]:
    """Files other than libraries, for some frame numbers; without numbers, the first file of each numbered series."""
    users = {}
    for datablock in reached:
        for image, user in _image_users(datablock):
            users.setdefault(image, []).append(user)
    for datablock in reached:
        if isinstance(datablock, _OWNERS_WITH_NODES):
            for path in live_nodes.light_profiles(datablock):
                yield RenderedFile(path, (_absolute(path, datablock.library),), kind=PROFILE)
        if isinstance(datablock, bpy.types.Image):
            yield from _image_files(datablock, users.get(datablock, ()), numbers)
        elif isinstance(datablock, bpy.types.Volume) and datablock.packed_file is None:
            yield from _numbered_file(datablock, datablock.is_sequence, ())
        elif isinstance(datablock, bpy.types.CacheFile):
            needed = [round(datablock.frame)] if datablock.override_frame else numbers
            yield from _numbered_file(datablock, datablock.is_sequence, needed)


def _image_users(datablock):
    """Return (image, its image user, which selects the frame of a sequence) of a datablock's nodes, or of a texture."""
    if isinstance(datablock, bpy.types.ImageTexture):
        return [(datablock.image, datablock.image_user)]
    if not isinstance(datablock, _OWNERS_WITH_NODES):
        return []
    # A compositor's node is its own image user.
    return [(image, getattr(node, "image_user", node)) for image, node in live_nodes.images(datablock)]


def _image_files(image, users, numbers):
    is_in_views = image.use_multiview and image.views_format == "INDIVIDUAL"
    if image.source in {"GENERATED", "VIEWER"} or len(image.packed_files) or is_in_views or not image.filepath:
        return
    path = _absolute(image.filepath, image.library)
    if image.source == "TILED":
        paths = tuple(_tile(path, tile.number) for tile in image.tiles)
        yield RenderedFile(image.filepath, paths, kind=IMAGE)
    elif image.source == "SEQUENCE":
        timed = [user for user in users if hasattr(user, "frame_duration")]
        needed = sorted({_image_number(user, number) for user in timed for number in numbers})
        paths = tuple(_numbered(path, number) for number in needed) or (path,)
        # For many frames, files are only counted. Each file is read before its frame.
        kind = IMAGE if len(numbers) == 1 else ""
        yield RenderedFile(image.filepath, paths, kind, siblings=_row_of(path))
    else:
        yield RenderedFile(image.filepath, (path,), kind=IMAGE if image.source == "FILE" else "")


def _numbered_file(datablock, is_sequence, numbers):
    if not datablock.filepath:
        return
    path = _absolute(datablock.filepath, datablock.library)
    if is_sequence:
        paths = tuple(_numbered(path, number) for number in numbers) or (path,)
        yield RenderedFile(datablock.filepath, paths, siblings=_row_of(path))
    else:
        yield RenderedFile(datablock.filepath, (path,))


def _image_number(user, frame):
    """Number of the image that an image user reads in a frame, as in Blender."""
    length = user.frame_duration
    place = frame - user.frame_start + 1
    if length and user.use_cyclic:
        place = place % length or length
    return min(max(place, 0), length) + user.frame_offset


def _numbered(path, number):
    """Return a path with the last number in its name replaced."""
    found = list(re.finditer(r"\d+", path.stem))
    if not found:
        return path
    last = found[-1]
    digits = f"{number:0{len(last[0])}d}"
    return path.with_name(path.stem[: last.start()] + digits + path.stem[last.end() :] + path.suffix)


def _row_of(path):
    """All files whose names differ from that of a path only in the last number."""
    found = list(re.finditer(r"\d+", path.stem))
    if not found or not path.parent.is_dir():
        return (path,)
    before, after = path.stem[: found[-1].start()], path.stem[found[-1].end() :] + path.suffix
    pattern = re.compile(re.escape(before) + r"\d+" + re.escape(after))
    return tuple(sorted(path.with_name(name) for name in os.listdir(path.parent) if pattern.fullmatch(name)))


def _tile(path, number):
    across, up = (number - 1001) % 10 + 1, (number - 1001) // 10 + 1
    name = path.name.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{across}_v{up}")
    return path.with_name(name)


def _absolute(path, library):
    return Path(bpy.path.abspath(path, library=library))


def _reader_of(file):
    return {IMAGE: _is_readable_image, PROFILE: _is_readable_profile}.get(file.kind, _is_there)


def _is_there(path):
    """Whether a file exists and is not empty."""
    return path.is_file() and path.stat().st_size > 0


def _is_readable_image(path):
    """Whether a file exists and Blender can read all of it as an image."""
    return _is_there(path) and _kept(path, _can_be_decoded)


def _is_readable_profile(path):
    """Whether a file exists and is a whole IES profile."""
    return _is_there(path) and _kept(path, lambda path: whole_images.is_whole_ies(path.read_bytes()))


def _kept(path, is_readable):
    """Return is_readable(path), which is called again only if the file has changed; false without permission to read
    the file.
    """
    status = path.stat()
    key = path, status.st_mtime_ns, status.st_size
    try:
        return readable_cache.get(key, lambda: is_readable(path))
    except OSError:
        return False


def _can_be_decoded(path):
    with path.open("rb") as file:
        head = file.read(16)
        is_whole = whole_images.is_whole(head + file.read()) if whole_images.has_structure(head) else None
    if is_whole is not None:
        return is_whole
    try:
        imbuf.load(str(path)).free()
    except (OSError, ValueError):
        return False
    return True
