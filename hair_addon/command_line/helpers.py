# SPDX-License-Identifier: GPL-3.0-or-later
"""Worker processes of one command on this machine."""

import contextlib
import json
import math
import queue
import signal
import subprocess
import threading
import time

from .console import PROGRAM

_LOOK = 0.2  # [s] between checks for an interruption
_PATIENCE = 30.0  # [s] to wait for a terminated process to exit


class Failed:
    """A failed process: its exit status, negative if a signal ended it, and its last error message.

    is_late: whether it was terminated at the time limit.
    """

    def __init__(self, status, complaint="", is_late=False):
        self.status, self.complaint, self.is_late = status, complaint, is_late

    @property
    def cause(self):
        """Cause of the failure, for messages."""
        return f"signal {-self.status}" if self.status < 0 else f"status {self.status}"

    def __str__(self):
        if self.complaint:
            return self.complaint
        if self.status < 0:
            return f"A worker process was killed by {self.cause}."
        return f"A worker process ended with {self.cause} and without an error message."


def run(commands, console, receive, step="", seconds=math.inf):
    """Run commands in parallel until all have ended; returns a `Failed` for each that failed.

    commands: argument lists of processes that print lines of JSON; receive(values): called with each line; step: name
    for progress; seconds: time limit, after which the processes are killed.
    """
    received = queue.Queue()
    helpers = []
    is_late, end = False, time.monotonic() + seconds
    try:
        helpers += [_Helper(words, received) for words in commands]
        while any(helper.is_running for helper in helpers) or not received.empty():
            console.progress(step or f"{len(helpers)} processes", 0.0)
            if time.monotonic() > end:
                is_late = True
                break
            try:
                values = received.get(timeout=_LOOK)
            except queue.Empty:
                continue
            receive(values)
    finally:
        for helper in helpers:
            helper.stop(_PATIENCE if not is_late else 0.0)
    return [Failed(helper.status, helper.complaint, is_late) for helper in helpers if helper.status != 0]


class _Helper:
    """A process, and the threads that read its output."""

    def __init__(self, words, received):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL}
        self._process = subprocess.Popen(words, text=True, encoding="utf-8", errors="replace", **pipes)
        self._received, self._complaints = received, []
        self._threads = [
            threading.Thread(target=target, daemon=True) for target in (self._read_output, self._read_errors)
        ]
        for thread in self._threads:
            thread.start()

    def _read_output(self):
        for line in self._process.stdout:
            # Blender prints messages before the command starts, and a process may be killed in the middle of a line.
            if line.startswith("{") and line.endswith("\n"):
                with contextlib.suppress(ValueError):
                    self._received.put(json.loads(line))

    def _read_errors(self):
        for line in self._process.stderr:
            if line.startswith(f"{PROGRAM}: ") and not line.startswith(f"{PROGRAM}: warning: "):
                self._complaints.append(line.removeprefix(f"{PROGRAM}: ").strip())

    @property
    def is_running(self):
        """Whether the process runs or has unread output."""
        return self._process.poll() is None or any(thread.is_alive() for thread in self._threads)

    @property
    def status(self):
        """The exit status of the ended process."""
        return self._process.returncode

    @property
    def complaint(self):
        """Last error message of the process; empty if there is none."""
        return self._complaints[-1] if self._complaints else ""

    def stop(self, patience):
        """Terminate the process; kill it if it still runs after `patience` [s]."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            try:
                self._process.wait(patience)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        for thread in self._threads:
            thread.join()
        for stream in (self._process.stdout, self._process.stderr):
            stream.close()
