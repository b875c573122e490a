# SPDX-License-Identifier: GPL-3.0-or-later
"""Another process of this program, which runs a command of its own while this one goes on."""

import os
import subprocess
import weakref
from pathlib import Path

from . import cli_command

_PACKAGE = Path(__file__).resolve().parents[2]


class OtherProcess:
    """A process that runs a command. Raises `OSError` if it cannot start.

    arguments: command line after the program's name; errors: `Path` of the file for its standard error output.
    """

    def __init__(self, arguments, errors):
        self._errors = errors
        inherited = os.environ.get("PYTHONPATH")
        paths = [str(_PACKAGE.parent), *([inherited] if inherited else [])]
        with errors.open("wb") as file:
            self._process = subprocess.Popen(
                [*cli_command.words(), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=file,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            )
        self._end = weakref.finalize(self, _end, self._process)  # also if nobody waits for it

    @property
    def is_running(self):
        """Whether it has not ended."""
        return self._process.poll() is None

    def wait(self, seconds):
        """Wait until the process ends; after these seconds it is killed."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self._end()

    def complaint(self):
        """Return the last line that the process wrote as an error; empty if there is none."""
        lines = self._errors.read_text("utf-8", "replace").split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "")


def _end(process):
    if process.poll() is None:
        process.kill()
    process.wait()
