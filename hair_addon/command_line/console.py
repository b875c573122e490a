# SPDX-License-Identifier: GPL-3.0-or-later
"""Output of a command: results on standard output, everything else on standard error."""

import contextlib
import json
import os
import sys
from dataclasses import dataclass
from typing import TextIO

from ..core.errors import HairError
from ..core.long_work import Stopped
from .interruption import Interruption

PROGRAM = "vellus"


@dataclass
class Console:
    """The two streams of a command, and its verbosity."""

    out: TextIO
    errors: TextIO
    interruption: Interruption
    is_quiet: bool = False
    is_json: bool = False
    _shown: str = ""

    def result(self, values, sentence):
        """Report a result: {name: value} for --json, otherwise a sentence.

        Raises `HairError` if standard output is closed or full, BrokenPipeError if its reader has gone.
        """
        self._clear()
        if self.is_quiet and not self.is_json:
            return
        try:
            print(json.dumps(values) if self.is_json else sentence, file=self.out, flush=True)
        except OSError as error:
            discard(self.out)
            if isinstance(error, BrokenPipeError):
                raise
            raise HairError(f"Results were lost: standard output cannot be written ({error.strerror}).") from error

    def warn(self, sentence):
        """Print a warning."""
        if not self.is_quiet:
            self.fail(f"warning: {sentence}")

    def fail(self, sentence):
        """Print the error that ends the command."""
        self._clear()
        _print_error(f"{PROGRAM}: {sentence}\n", self.errors)

    def progress(self, step, part):
        """Show progress on a terminal; raises `Stopped` if an interruption was requested."""
        if self.interruption.is_asked:
            raise Stopped
        if self.is_quiet or not self.errors.isatty():
            return
        shown = f"{step}: {round(100 * part)} %"
        if shown != self._shown:
            self._clear()
            _print_error(shown, self.errors)
            self._shown = shown

    def _clear(self):
        if self._shown:
            _print_error("\r\x1b[K", self.errors)
            self._shown = ""


def _print_error(text, stream):
    """Write to standard error; if it is closed or full, the exit status is enough."""
    try:
        print(text, end="", file=stream, flush=True)
    except OSError:
        discard(stream)


def discard(stream):
    """Discard further output to a broken stream; otherwise Python reports an error when flushing it on exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def occupy_closed_streams():
    """Open the null device for closed standard streams, before another file gets their descriptors.

    Reads return nothing, and writes fail.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDONLY)


@contextlib.contextmanager
def own_streams(is_verbose):
    """Yield (out, errors) for the command only. Other output of the process is discarded, or goes to errors.

    This lasts until the process exits, when libraries flush their buffers.
    """
    for stream in filter(None, (sys.stdout, sys.stderr)):  # None where it is closed
        with contextlib.suppress(OSError):
            stream.flush()
    out, errors = (os.fdopen(os.dup(number), "w", encoding="utf-8", errors="backslashreplace") for number in (1, 2))
    chatter = os.dup(2) if is_verbose else os.open(os.devnull, os.O_WRONLY)
    os.dup2(chatter, 1)
    os.dup2(chatter, 2)
    os.close(chatter)
    sys.stderr = errors  # show the traceback of a bug
    yield out, errors
    out.flush()
