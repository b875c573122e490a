# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender without a window, which runs jobs of this Blender in the background, one after another.

The first job starts it. It ends after some minutes without jobs, and when this process ends or is killed. A job is a
folder with its values. The other process reads the path of the folder and writes files into it. Its temporary files are
in a folder that is removed when it has ended.
"""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import weakref
from pathlib import Path

from . import cli_command

VALUES, BEGUN, ENDED = "job.json", "begun", "ended.txt"  # files of a job; the last contains its error, if any
IDLE = 300.0  # [s] without jobs after which the process ends

_PACKAGE = Path(__file__).resolve().parents[2]
_MOST_ATTEMPTS = 2  # to start a job
_FIRST_LOOK, _LONGEST_LOOK = 0.002, 0.05  # [s] between checks while waiting

_REMOVE = """
import json, shutil, sys
for folder in json.load(sys.stdin):
    shutil.rmtree(folder, ignore_errors=True)
"""

_running = None  # the `_Process` of this Blender


class Job:
    """A job in a folder. Raises `OSError` if the other process cannot start.

    values: numbers, strings and lists for `background_jobs`, with the "kind" of the job.
    """

    def __init__(self, folder, values):
        self._folder, self._attempts, self._error, self._has_ended = folder, 0, "", False
        (folder / VALUES).write_text(json.dumps(values), "utf-8")
        self._send()

    def _send(self):
        self._attempts += 1
        self._process = _usable_process()
        try:
            self._process.send(self._folder)
        except OSError:  # it has just ended
            self._process.end()

    def is_ended(self):
        """Whether the job has ended, or its process."""
        # Tested first: a process that has ended writes no more files.
        is_running = self._process.is_running
        self._has_ended = self._has_ended or (self._folder / ENDED).is_file()  # kept, because its folder may be removed
        if self._has_ended:
            return True
        if is_running or self._error:
            return not is_running
        if not (self._folder / BEGUN).exists() and self._attempts < _MOST_ATTEMPTS:
            try:
                self._send()  # the process was idle for too long, or another job has ended it
            except OSError as error:
                self._error = str(error)
            return bool(self._error)
        return True

    def wait(self, seconds):
        """Wait until the job has ended; after these seconds its process is killed."""
        end, pause = time.monotonic() + seconds, _FIRST_LOOK
        while not self.is_ended():
            if time.monotonic() > end:
                self._error = f"It took more than {seconds:g} seconds."
                self._process.end()
            time.sleep(pause)
            pause = min(2.0 * pause, _LONGEST_LOOK)

    def drop(self):
        """Give up the job. If it is running, its process is killed, so that other jobs can run."""
        if (self._folder / BEGUN).exists() and not (self._folder / ENDED).exists():
            self._process.end()

    def complaint(self):
        """Return why the ended job failed, or an empty string."""
        try:
            return (self._folder / ENDED).read_text("utf-8")
        except OSError:
            return self._error or self._process.complaint()


class _Process:
    """The other process. Raises `OSError` if it cannot start."""

    def __init__(self):
        folder = Path(tempfile.mkdtemp(prefix="vellus_"))
        # Blender leaves its folder of temporary files behind if it is killed.
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._errors = folder / "errors"
        inherited = os.environ.get("PYTHONPATH")
        paths = [str(_PACKAGE.parent), *([inherited] if inherited else [])]
        with self._errors.open("wb") as file:
            self._process = subprocess.Popen(
                [*cli_command.words(), "background", str(folder)],
                stdin=subprocess.PIPE,  # closed when this process ends, which ends the other
                stdout=subprocess.DEVNULL,
                stderr=file,
                env={**os.environ, **temporary, "PYTHONPATH": os.pathsep.join(paths)},
            )
        self.end = weakref.finalize(self, _end, self._process)

    @property
    def is_running(self):
        """Whether it has not ended."""
        return self._process.poll() is None

    def send(self, folder):
        """Send a job. Raises `OSError` if the process has ended."""
        self._process.stdin.write(json.dumps(str(folder)).encode() + b"\n")
        self._process.stdin.flush()

    def complaint(self):
        """Return the last line of the process's error output, or a sentence with its exit status."""
        lines = self._errors.read_text("utf-8", "replace").split("\n")
        found = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return found or f"Blender's background process ended with status {self._process.poll()}."


def _end(process):
    if process.poll() is None:
        process.kill()
    process.wait()
    with contextlib.suppress(OSError):  # jobs that could not be sent
        process.stdin.close()


def _usable_process():
    global _running
    if _running is None or not _running.is_running:
        _running = _Process()
    return _running


def end():
    """End the other process, with its jobs."""
    global _running
    if _running is not None:
        _running.end()
    _running = None


def exit_and_remove(folders):
    """End this process, and start another that then removes folders: jobs and Blender write into them until the end."""
    with contextlib.suppress(OSError):  # no process can start: the folders are left
        remover = subprocess.Popen(
            [sys.executable, "-I", "-c", _REMOVE],
            stdin=subprocess.PIPE,  # closed by the end of this process
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        remover.stdin.write(json.dumps([str(each) for each in folders if os.path.exists(each)]).encode())
        remover.stdin.flush()
    os._exit(0)
