# SPDX-License-Identifier: GPL-3.0-or-later
"""What a command says, and where: results on standard output; all else on standard error."""

import contextlib
import json
import os
import sys
from dataclasses import dataclass
from typing import TextIO

from ..core.long_work import Stopped
from .interruption import Interruption

PROGRAM = "vellus"


@dataclass
class Console:
    """The two streams of a command, and how much is said on them."""

    out: TextIO
    errors: TextIO
    interruption: Interruption
    is_quiet: bool = False
    is_json: bool = False
    _shown: str = ""

    def result(self, values, sentence):
        """Tell what was made: {name: value} for programs, a sentence for people."""
        self._clear()
        if self.is_json:
            print(json.dumps(values), file=self.out, flush=True)
        elif not self.is_quiet:
            print(sentence, file=self.out, flush=True)

    def warn(self, sentence):
        """Tell what may surprise, though it does not end the command."""
        if not self.is_quiet:
            self.fail(f"warning: {sentence}")

    def fail(self, sentence):
        """Tell why the command ends."""
        self._clear()
        print(f"{PROGRAM}: {sentence}", file=self.errors, flush=True)

    def progress(self, step, part):
        """Show on a terminal how far long work is; raises `Stopped` where somebody has asked to stop it."""
        if self.interruption.is_asked:
            raise Stopped
        if self.is_quiet or not self.errors.isatty():
            return
        shown = f"{step}: {round(100 * part)} %"
        if shown != self._shown:
            self._clear()
            print(shown, end="", file=self.errors, flush=True)
            self._shown = shown

    def _clear(self):
        if self._shown:
            print("\r\x1b[K", end="", file=self.errors, flush=True)
            self._shown = ""


@contextlib.contextmanager
def own_streams(is_verbose):
    """(out, errors) for a command alone. What Blender, drivers and other add-ons print goes nowhere, or to errors.

    It stays so to the end of the process, when what libraries still hold back is written.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    out, errors = (os.fdopen(os.dup(number), "w", encoding="utf-8", errors="backslashreplace") for number in (1, 2))
    chatter = os.dup(2) if is_verbose else os.open(os.devnull, os.O_WRONLY)
    os.dup2(chatter, 1)
    os.dup2(chatter, 2)
    os.close(chatter)
    sys.stderr = errors  # a defect's traceback is no chatter
    yield out, errors
    out.flush()
