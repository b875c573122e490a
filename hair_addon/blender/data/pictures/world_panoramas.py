# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramas of worlds and lights whose nodes Vellus does not read: Cycles renders them once, in another process.

Panoramas are kept by the digest of the nodes: in the user's folder of the extension, or as long as Blender runs.
"""

import tempfile
from pathlib import Path

import bpy

from ....core.errors import HairError, cause_of
from ...host.caches import Cache
from ...host.notices import name_of
from ...host.other_process import OtherProcess
from ...settings.translations import interface_text
from . import kept_files, unsaved_images, world_digest

_PATIENCE = 300.0  # [s] for a panorama
_LOOK = 0.25  # [s] between checks of processes

process_cache = Cache()  # digest → _Rendering: running, or failed
last_cache = Cache()  # session_uid of a world or light → the last panorama of any of its nodes


def library_of(original):
    """Return the path of the library of a linked datablock, "" for a local one."""
    library = original.library
    return "" if library is None else bpy.path.abspath(library.filepath, library=library.parent)


class _Rendering:
    """A panorama that another process renders; reason: why it failed, empty otherwise."""

    def __init__(self, owner, path, frame, options):
        self.reason, self._path, self.name = "", path, name_of(owner)
        self.is_world = isinstance(owner, bpy.types.World)
        # Beside the path, as a file cannot be renamed to another file system.
        self._folder = tempfile.TemporaryDirectory(prefix=".", dir=path.parent, ignore_cleanup_errors=True)
        folder = Path(self._folder.name)
        blend, self._made = folder / "owner.blend", folder / f"panorama{path.suffix}"
        # A .blend contains only links to linked datablocks.
        words = ["panorama", library_of(owner.original) or str(blend), "--out", str(self._made)]
        words += ["--frame", repr(float(frame)), "--name", owner.original.name, *options]
        try:
            if owner.original.library is None:
                bpy.data.libraries.write(str(blend), {owner.original}, path_remap="ABSOLUTE", fake_user=True)
                unsaved_images.write(folder, [owner.original.node_tree])
            self._process = OtherProcess(words, folder / "errors")
        except (OSError, RuntimeError) as error:
            self._process, self.reason = None, cause_of(error)

    @property
    def is_running(self):
        """Whether it runs, or its end has not been handled yet."""
        return self._process is not None

    def is_ended(self, waits):
        """Whether it has ended, after waiting if `waits`; the file is then in its place, or there is a reason."""
        if self._process is not None and waits:
            self._process.wait(_PATIENCE)
        if self._process is None or self._process.is_running:
            return self._process is None
        complaint, self._process = self._process.complaint(), None
        try:
            self._made.replace(self._path)
        except OSError as error:
            self.reason = complaint or cause_of(error)
        self._folder.cleanup()
        return True


def file_of(world, frame, waits):
    """Return the OpenEXR file with the panorama of a world at a frame; None while it is rendered.

    waits: return only once it is there. Raises `HairError` if it cannot be rendered.
    """
    path = kept_files.folder("worlds") / f"{world_digest.digest_of(world)}.exr"
    return kept_or_rendered(world, path, frame, waits)


def kept_or_rendered(owner, path, frame, waits, options=()):
    """Return the path of the panorama of a world or light, whose name is a digest; None while it is rendered.

    waits: as of `file_of`; options: of the command that renders. Raises `HairError` if it cannot be rendered.
    """
    digest, uid = path.stem, owner.original.session_uid
    if path.is_file():
        process_cache.invalidate(digest)
        return last_cache.keep(uid, path)
    rendering = process_cache.get(digest)
    if rendering is None and (waits or not _running()):  # a view has one process, as dragged or played nodes change
        rendering = process_cache.keep(digest, _Rendering(owner, path, frame, options))
    if rendering is None or not rendering.is_ended(waits):
        if not bpy.app.timers.is_registered(look):
            bpy.app.timers.register(look, first_interval=_LOOK, persistent=True)
        return None
    if rendering.reason:
        sentence = 'Cycles cannot render the nodes of the light "{light}": {reason}'
        if rendering.is_world:
            sentence = 'Cycles cannot render the nodes of the world "{world}": {reason}'
        raise HairError(sentence, world=rendering.name, light=rendering.name, reason=rendering.reason)
    kept_files.remove_oldest(path)
    process_cache.invalidate(digest)
    return last_cache.keep(uid, path)


def last_of(owner):
    """Return the last panorama of a world or light, with other nodes, for views while its next one is rendered; None
    without one.
    """
    path = last_cache.get(owner.original.session_uid)
    return path if path is not None and path.is_file() else None


def sentences():
    """Translated sentences about panoramas that are rendered now, for panels."""
    named = sorted({(one.name, one.is_world) for one in _running()})
    return [_sentence_of_world(name) if is_world else _sentence_of_light(name) for name, is_world in named]


def _sentence_of_world(name):
    return interface_text(
        'Cycles renders the nodes of the world "{world}" as a panorama. '
        "Until it is ready, views have the last one, or the viewport color.",
        world=name,
    )


def _sentence_of_light(name):
    return interface_text(
        'Cycles renders the nodes of the light "{light}" as a panorama. '
        "Until it is ready, views have the last one, or the light without nodes.",
        light=name,
    )


def look():
    """Timer: show finished panoramas. Returns the time to the next check [s], None after the last."""
    ended = [one.is_ended(waits=False) for one in _running()]
    if any(ended):
        for owner in (*bpy.data.worlds, *bpy.data.lights):
            owner.update_tag()
        redraw_panels()
    return _LOOK if _running() else None


def redraw_panels():
    """Redraw panels and viewports."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "VIEW_3D"}:
                area.tag_redraw()


def _running():
    return [one for one in process_cache.values() if isinstance(one, _Rendering) and one.is_running]
