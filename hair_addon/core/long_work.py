# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps: what must happen on the caller's thread, and what may happen on another one while a window lives on.

Such work is a generator. It reads, yields a function of (progress) that computes, gets its result sent back, and
writes; what it returns is what was made. `run_now` runs it in one go, and a `Job` runs one computation in a thread.
Kernels run without Python's lock, so a window is drawn meanwhile.
"""

import threading
from dataclasses import dataclass


class Stopped(Exception):
    """Raised inside a computation that somebody has stopped."""


def unheard(_step, _part):
    """Progress that nobody watches. step: what is being done, in a word or two; part: of the whole, in [0, 1]."""


@dataclass(frozen=True)
class Stage:
    """What work yields before a stage that must run on the caller's thread: there it is told, and may be stopped."""

    step: str
    part: float

    def __call__(self, progress):
        progress(self.step, self.part)


def part_of(progress, first, last):
    """Progress of a stage that makes up the part between `first` and `last` of the whole."""
    return lambda step, part: progress(step, first + (last - first) * part)


def run_now(work, progress=unheard):
    """Run a generator of the kind above to its end; returns what it returns. progress: told how far each part is."""
    try:
        compute = next(work)
        while True:
            compute = work.send(compute(progress))
    except StopIteration as end:
        return end.value


class Job:
    """A computation in a thread of its own; step and part say how far it is."""

    def __init__(self, compute):
        self.step, self.part = "", 0.0
        self._result, self._error = None, None
        self._is_stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(compute,), name="vellus", daemon=True)
        self._thread.start()
        if isinstance(compute, Stage):
            self.wait()

    def _run(self, compute):
        try:
            self._result = compute(self._progress)
        except BaseException as error:  # whatever it is belongs to whoever asks for the result
            self._error = error

    def _progress(self, step, part):
        if self._is_stopped.is_set():
            raise Stopped
        self.step, self.part = step, part

    @property
    def is_done(self):
        """Whether `result` returns at once."""
        return not self._thread.is_alive()

    def stop(self):
        """Ask the computation to end at its next step."""
        self._is_stopped.set()

    @property
    def is_stopping(self):
        """Whether it was asked to end."""
        return self._is_stopped.is_set()

    def wait(self):
        """Return when the computation has ended, however it did."""
        self._thread.join()

    def result(self):
        """What was computed; waits for it. Raises what the computation raised, `Stopped` if it was stopped."""
        self.wait()
        if self._error is not None:
            raise self._error
        if self.is_stopping:
            raise Stopped
        return self._result
