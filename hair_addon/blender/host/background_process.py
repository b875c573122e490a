# SPDX-License-Identifier: GPL-3.0-or-later
"""Another Blender without a window, which runs jobs of this Blender one after the other while this one goes on.

The first job starts it. It ends when it has had no job for some minutes, and with this process, also if that is killed.
A job is a folder with its values. The other process reads the path of the folder, and writes files into it. Temporary
files of the other process are in a folder that is removed after its end.
"""

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
import weakref
from pathlib import Path

from . import cli_command

VALUES, BEGUN, ENDED = "job.json", "begun", "ended.txt"  # files in the folder of a job; the last contains an error
IDLE = 300.0  # [s] until the process ends without jobs

_PACKAGE = Path(__file__).resolve().parents[2]
_MOST_ATTEMPTS = 2  # of a job that has not begun
_FIRST_LOOK, _LONGEST_LOOK = 0.002, 0.05  # [s] between checks while waiting

_running = None  # the `_Process` of this Blender


class Job:
    """A job in a folder. Raises `OSError` if the other process cannot start.

    values: numbers, texts and lists, with the "kind" of job, for `background_jobs`.
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
        # A process that ends writes nothing after this test.
        is_running = self._process.is_running
        self._has_ended = self._has_ended or (self._folder / ENDED).is_file()  # its folder may be removed then
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
        """Give up the job. A process that has begun it is killed, so that it is free for others."""
        if (self._folder / BEGUN).exists() and not (self._folder / ENDED).exists():
            self._process.end()

    def complaint(self):
        """Return why the ended job has failed; empty if it has not."""
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
                stdin=subprocess.PIPE,  # its end tells the other process that this one has ended
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
        """Return the last line that the process wrote as an error, or how it ended."""
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
