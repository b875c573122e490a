# SPDX-License-Identifier: GPL-3.0-or-later
"""Long operations as generators: steps on the caller's thread, and computations that may run on another one.

A generator reads its input, yields a function `compute(progress)`, receives the function's result, writes it, and
returns what it created. `run_now` runs a generator at once; a `Job` runs one computation in a thread. Kernels release
the GIL, so the window is redrawn meanwhile.
"""

import threading
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeVar

from .errors import memory_as_sentence

Progress = Callable[[str, float], None]  # (step, completed fraction)
Compute = Callable[[Progress], Any]
T = TypeVar("T")
Work = Generator[Compute, Any, T]


class Stopped(Exception):
    """Raised inside a computation that was canceled."""


def no_progress(_step: str, _part: float) -> None:
    """Ignore progress. step: the current step, in a word or two; part: completed fraction, in [0, 1]."""


@dataclass(frozen=True)
class Stage:
    """A step on the caller's thread: a generator yields it first, to report progress and allow canceling."""

    step: str
    part: float

    def __call__(self, progress: Progress) -> None:
        progress(self.step, self.part)


def part_of(progress: Progress, first: float, last: float) -> Progress:
    """Return the progress callback of a stage that covers the fractions `first` to `last` of the whole."""
    return lambda step, part: progress(step, first + (last - first) * part)


def run_now(work: Work[T], progress: Progress = no_progress) -> T:
    """Run a generator of this module to its end and return its result. progress: callback for each computation.

    An error in a computation or in `progress` closes the generator, which undoes its changes.
    """
    try:
        with memory_as_sentence():
            compute = next(work)
            while True:
                compute = work.send(compute(progress))
    except StopIteration as end:
        return end.value
    finally:
        work.close()


class Job:
    """A computation in its own thread, with its progress as step and part."""

    def __init__(self, compute: Compute) -> None:
        self.step, self.part = "", 0.0
        self._result: Any = None
        self._error: BaseException | None = None
        self._is_stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(compute,), name="vellus", daemon=True)
        self._thread.start()
        if isinstance(compute, Stage):
            self.wait()

    def _run(self, compute):
        try:
            self._result = compute(self._progress)
        except BaseException as error:  # re-raised by `result`
            self._error = error

    def _progress(self, step, part):
        if self._is_stopped.is_set():
            raise Stopped
        self.step, self.part = step, part

    @property
    def is_done(self) -> bool:
        """Whether `result` returns at once."""
        return not self._thread.is_alive()

    def stop(self) -> None:
        """Request the computation to end at its next step."""
        self._is_stopped.set()

    @property
    def is_stopping(self) -> bool:
        """Whether `stop` was called."""
        return self._is_stopped.is_set()

    def wait(self) -> None:
        """Wait until the computation has ended, with or without an error."""
        self._thread.join()

    def result(self) -> Any:
        """Wait for the result and return it. Re-raises the computation's exceptions; raises `Stopped` after `stop`."""
        self.wait()
        if self._error is not None:
            with memory_as_sentence():
                raise self._error
        if self.is_stopping:
            raise Stopped
        return self._result
