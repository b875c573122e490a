# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs that `host.background_process` sends: pictures of worlds, lights and surfaces by Cycles."""

import contextlib
import json
import os
import queue
import threading
from pathlib import Path

from ....core.errors import HairError, cause_of
from ...data.pictures.picture_jobs import BLEND
from ...host import background_process
from . import light_panorama, surface_bake, world_panorama


def serve(stream, temporary):
    """Run jobs until none has arrived for some minutes.

    stream: a file descriptor with the path of a job's folder in each line, as JSON; temporary: the folder of temporary
    files. At the end of the stream the process ends at once, even during a job, and these folders are removed.
    """
    folders = queue.Queue()
    threading.Thread(target=_read, args=(stream, folders, temporary), daemon=True).start()
    with contextlib.suppress(queue.Empty):
        while True:
            _run(Path(folders.get(timeout=background_process.IDLE)))


def _read(stream, folders, temporary):
    """Read the folders into a queue. Python's own streams would hold a lock when the process ends."""
    rest, seen = b"", []
    while found := os.read(stream, 1 << 16):
        *lines, rest = (rest + found).split(b"\n")
        for line in lines:
            seen.append(json.loads(line))
            folders.put(seen[-1])
    background_process.exit_and_remove([*seen, temporary])


def _run(folder):
    """Run a job. Its folder is missing if the job was dropped."""
    with contextlib.suppress(FileNotFoundError):
        (folder / background_process.BEGUN).touch()
        values, reason = json.loads((folder / background_process.VALUES).read_text("utf-8")), ""
        try:
            _KINDS[values.pop("kind")](folder, **values)
        except HairError as error:
            reason = str(error)
        except (MemoryError, OSError, RuntimeError) as error:
            reason = cause_of(error)
        part = folder / f"{background_process.ENDED}.part"
        part.write_text(reason, "utf-8")
        os.replace(part, folder / background_process.ENDED)


def _world(folder, sources, digest, frame, is_coarse):
    ((library, name),) = sources
    world_panorama.render(library or folder / BLEND, name, digest, frame, is_coarse, folder / "0.exr")


def _light(folder, sources, frame, is_coarse, matrix):
    ((library, name),) = sources
    light_panorama.render(library or folder / BLEND, name, matrix, frame, is_coarse, folder / "0.npz")


def _surfaces(folder, sources, frame, is_coarse, for_render):
    surface_bake.bake(folder / BLEND, sources, frame, for_render, is_coarse, folder)


_KINDS = {"world": _world, "light": _light, "surfaces": _surfaces}
