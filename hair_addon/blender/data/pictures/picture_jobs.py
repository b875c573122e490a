# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of worlds, lights and surfaces that a background process makes with Cycles, and their files."""

import shutil
import threading
import weakref

import bpy

from ....core.errors import HairError, cause_of
from ...host import background_process
from ...host.caches import Cache
from ...host.notices import name_of
from ...settings.translations import interface_text
from . import kept_files, unsaved_images

BLEND = "owners.blend"  # in the folder of a job: its local worlds, lights or objects

_PATIENCE = 600.0  # [s] for a job
_LOOK = 0.05  # [s] between checks of jobs

job_cache = Cache()  # path of a file → `PictureJob`: running, or failed
last_cache = Cache()  # session_uid of a world, light or object → path of its last picture, also of former nodes

# Kind of job → (sentence while a picture is made, sentence if it cannot be made).
_SENTENCES = {
    "world": (
        'Cycles is rendering the nodes of the world "{name}". Until then, its last picture or viewport color is shown.',
        'Cycles cannot render the nodes of the world "{name}": {reason}',
    ),
    "light": (
        'Cycles is rendering the nodes of the light "{name}". Until then, its last picture or plain light is used.',
        'Cycles cannot render the nodes of the light "{name}": {reason}',
    ),
    "surfaces": (
        'Cycles is baking the materials of "{name}". Until then, their previous pictures or plain colors are shown.',
        'Cycles cannot bake the materials of "{name}": {reason}',
    ),
}


class PictureJob:
    """Files of pictures that the background process makes.

    owners: {path of a file: original world, light or object that it shows}; used: set of paths of files in use, which
    are not removed; values: arguments of this kind of job. reasons: {path: why the file cannot be made}.
    """

    def __init__(self, kind, owners, used, values):
        self.kind, self.reasons, self._used = kind, {}, used
        self._names = {path: name_of(one) for path, one in owners.items()}
        self._lock = threading.Lock()
        sources = [(library_of(one), one.name) for one in owners.values()]
        try:
            # Beside the files, because a file cannot be renamed to another file system.
            folder = kept_files.new_job(next(iter(owners)).parent)
            self._remove = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            local = {one for one in owners.values() if one.library is None}  # the others are read from their libraries
            blend = folder / BLEND
            bpy.data.libraries.write(str(blend), local, path_remap="ABSOLUTE", fake_user=True)
            unsaved_images.write(folder, [tree for one in local for tree in _trees_of(one)])
            self._job, self._folder = (
                background_process.Job(folder, {"kind": kind, "sources": sources, **values}),
                folder,
            )
            self._drop = weakref.finalize(self, self._job.drop)  # called before `_remove`
        except (OSError, RuntimeError) as error:
            self._job, self.reasons = None, dict.fromkeys(owners, cause_of(error))

    @property
    def paths(self):
        """Paths of the files."""
        return list(self._names)

    @property
    def is_running(self):
        """Whether it runs, or its end has not been handled yet."""
        return self._job is not None

    def is_ended(self, waits):
        """Whether the job has ended, after waiting if `waits`; each file is then in its place, or there is a reason."""
        job = self._job
        if job is not None and waits:
            job.wait(_PATIENCE)
        with self._lock:  # a render in its thread may wait for the job of a view
            if self._job is not None and job.is_ended():
                self._place(job.complaint())
                self._job = None
        return self._job is None

    def _place(self, complaint):
        """Move the files of the ended job into their places; complaint: why it failed, or empty."""
        for index, path in enumerate(self._names):
            made = self._folder / f"{index}{path.suffix}"
            try:
                made.replace(path)
            except OSError as error:
                refusal = made.with_suffix(".txt")
                told = refusal.read_text("utf-8") if refusal.is_file() else complaint
                self.reasons[path] = told or cause_of(error)
                continue
            _coarse(path).unlink(missing_ok=True)
            kept_files.remove_oldest(path, self._used.union(last_cache.values()))
        self._drop.detach()
        self._remove()

    def sentences(self):
        """Return (translated sentence, whether it is an error) of each file that is being made or cannot be made."""
        running, failed = _SENTENCES[self.kind]
        if self.is_running:
            return [(interface_text(running, name=name), False) for name in self._names.values()]
        return [
            (interface_text(failed, name=self._names[path], reason=interface_text(reason)), True)
            for path, reason in self.reasons.items()
        ]

    def error(self, path):
        """Return the `HairError` of a file that cannot be made."""
        return HairError(_SENTENCES[self.kind][1], name=self._names[path], reason=self.reasons[path])


def files_of(kind, owners, waits, **values):
    """Return ({path: file with its picture}, [`HairError` of each file that cannot be made]) for {path: original}.

    Missing files are made. waits: return when they are made or have failed. Viewports do not wait: they have coarse
    pictures until the fine ones are made, and at most one job of each kind at a time, because dragged or animated nodes
    change in each frame.
    """
    missing = {path: one for path, one in owners.items() if not path.is_file()}
    errors = []
    if missing:
        used = {file for path in owners for file in (path, _coarse(path))}
        first = {} if waits else {_coarse(path): one for path, one in missing.items()}
        errors = _make(kind, first, waits, used, {**values, "is_coarse": True})
        then = {path: one for path, one in missing.items() if waits or _coarse(path).is_file()}
        errors += _make(kind, then, waits, used, {**values, "is_coarse": False})
    found = {}
    for path in owners:
        if path.is_file():
            found[path] = path
        elif not waits and _coarse(path).is_file():
            found[path] = _coarse(path)
    return found, errors


def read(read_files, waits):
    """Return pictures from read_files(), which returns None if a file was damaged and removed.

    waits: read again, as the file is then made again. Raises `HairError` if that file is damaged too.
    """
    found = read_files()
    if found is None and waits:
        found = read_files()
        if found is None:
            raise HairError("Files that Cycles has rendered are damaged: check the disk.")
    return found


def _make(kind, owners, waits, used, values):
    """Make the missing files of {path: original}; return a `HairError` of each that cannot be made.

    used: paths of files that are in use and are not removed.
    """
    missing = {path: one for path, one in owners.items() if not path.is_file()}
    new = {path: one for path, one in missing.items() if not _is_known(path)}
    if new and (waits or not any(job.kind == kind for job in running())):
        job = PictureJob(kind, new, used, values)
        for path in new:
            job_cache.keep(path, job)
    jobs = {path: job_cache.get(path) for path in missing}
    for job in dict.fromkeys(filter(None, jobs.values())):
        job.is_ended(waits)
    if missing and not waits and running() and not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=_LOOK, persistent=True)
    return [job.error(path) for path, job in jobs.items() if job is not None and path in job.reasons]


def _coarse(path):
    """Return the path of the coarse version of a picture."""
    return path.with_suffix(f".coarse{path.suffix}")


def library_of(original):
    """Return the path of the library of a linked datablock, "" for a local one."""
    library = original.library
    return "" if library is None else bpy.path.abspath(library.filepath, library=library.parent)


def last_of(owner):
    """Return the last picture of a world or light, also of its former nodes, for viewports until its next one is made;
    None without one.
    """
    path = last_cache.get(owner.original.session_uid)
    return path if path is not None and path.is_file() else None


def running():
    """Return the running jobs."""
    return list({job: None for job in job_cache.values() if job.is_running})


def sentences():
    """Return (translated sentence, whether it is an error) for panels, about pictures that are missing."""
    found = [sentence for job in dict.fromkeys(job_cache.values()) for sentence in job.sentences()]
    return sorted(dict.fromkeys(found))


def has_failed():
    """Whether there are files that cannot be made."""
    return any(job.reasons and not job.is_running for job in job_cache.values())


def try_again():
    """Forget failed jobs, so that viewports start them again."""
    for path in [path for job in job_cache.values() if not job.is_running for path in job.paths]:
        job_cache.invalidate(path)
    _show()


def look():
    """Timer: show finished pictures. Returns the time to the next check [s], None after the last."""
    ended = [job.is_ended(waits=False) for job in running()]
    if any(ended):
        _show()
    return _LOOK if running() else None


def _show():
    """Redraw viewports and panels."""
    for owner in (*bpy.data.worlds, *bpy.data.lights, *bpy.data.materials):
        owner.update_tag()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "VIEW_3D"}:
                area.tag_redraw()


def _is_known(path):
    """Whether a missing file is being made or cannot be made."""
    job = job_cache.get(path)
    return job is not None and (job.is_running or path in job.reasons)


def _trees_of(owner):
    """Return the node trees of a world, a light or the materials of an object."""
    found = [slot.material for slot in owner.material_slots] if isinstance(owner, bpy.types.Object) else [owner]
    return [one.node_tree for one in found if one is not None and one.node_tree is not None]
